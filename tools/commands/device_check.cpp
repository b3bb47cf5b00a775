#include "tools/commands/device_check.h"

#include "device/bridge/bridge_device.h"
#include "device/falcon/falcon.h"
#include "device/gamepad/gamepad_port.h"
#include "device/haply/haply_device.h"
#include "device/spacemouse/spacemouse.h"
#include "solver/loop/haptic_loop.h"
#include "tools/commands/device_checker.h"
#include "tools/program/interruption.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

using Clock = std::chrono::steady_clock;

struct Opened {
  explicit Opened(HapticDevice& what) : device(what) { device.open(); }
  ~Opened() { device.close(); }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  HapticDevice& device;
};

constexpr double kSweepLimit_N_m = 200;  // of a device that states no stiffness
constexpr double kServiceTime_s = 0.2;

const char* instructionFor(DeviceWalk::Phase phase, bool renders_force) {
  switch (phase) {
    case DeviceWalk::Phase::workspace:
      return "workspace: move the handle to all ends of its reach";
    case DeviceWalk::Phase::gravity:
      return "gravity: let the handle rest, or let go of it if it stays up";
    case DeviceWalk::Phase::springs:
      return "springs: hold the grip loosely: a spring will pull along x, y and z";
    case DeviceWalk::Phase::damping:
      return "damping: move the handle to and fro";
    case DeviceWalk::Phase::sweep:
      return "stability: hold the grip loosely and still; keep the power switch within reach";
    case DeviceWalk::Phase::over:
      break;
  }
  return renders_force ? "the test is over: the force is off" : "the test is over";
}

DeviceWalkFound walkThrough(HapticDevice& device, const DeviceCheckOptions& options,
                            const std::function<void(const std::string&)>& tell) {
  const DeviceCapabilities& capabilities = device.capabilities();
  const bool renders_force = capabilities.peak_force_N > 0;
  const double most_N_m = capabilities.max_stiffness_N_m > 0 ? capabilities.max_stiffness_N_m : kSweepLimit_N_m;
  DeviceWalk walk(*options.walk, renders_force, most_N_m);
  HapticLoop loop(device, [&walk](const DeviceState& state, double dt_s) { return walk.tick(state, dt_s); });
  loop.start();
  std::optional<DeviceWalk::Phase> told;
  while (loop.running() && !walk.over()) {
    throwIfInterrupted();
    if (const DeviceWalk::Phase phase = walk.phase(); told != phase) {
      tell(instructionFor(phase, renders_force));
      told = phase;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  loop.stop();
  if (!loop.fault().empty()) throw DeviceError(capabilities.name + ": " + loop.fault());
  tell(instructionFor(DeviceWalk::Phase::over, renders_force));
  return walk.found();
}

}  // namespace

std::vector<FoundDevice> devicesOf(const HaplyServiceState& service) {
  std::vector<FoundDevice> found;
  for (const HaplyServiceState::Device& one : service.devices) {
    FoundDevice device;
    device.kind = "Haply Inverse3";
    device.device = "haply," + one.id;
    device.info.product_name = one.id;
    device.state = one.state;
    device.remedy = one.remedy;
    if (device.remedy.empty() && one.in_use) device.remedy = "another program uses it: forces of all programs add up";
    found.push_back(std::move(device));
  }
  return found;
}

std::vector<FoundDevice> findDevices(UsbTransport& transport) {
  std::vector<FoundDevice> found;
  for (const UsbDeviceInfo& info : transport.devices()) {
    FoundDevice device;
    device.info = info;
    device.state = "ready";
    if (info.vendor == kFalconVendor && info.product == kFalconProduct) {
      device.kind = "Novint Falcon";
      device.device = "falcon";
      const char* file = std::getenv(kFalconFirmwareVariable);
      if (file == nullptr || ::access(file, R_OK) != 0) {
        device.state = "no_firmware";
        device.remedy =
            std::string(file == nullptr ? "no firmware file is named" : "the firmware file cannot be read") + ": set " +
            kFalconFirmwareVariable +
            ", or give falcon:FILE; the file comes with Novint's driver. Not needed while the device keeps the "
            "firmware that was loaded since it got power";
      }
    } else if (isSpaceMouse(info)) {
      device.kind = "3Dconnexion mouse";
      device.device = "spacemouse:" + info.bus_path;
    } else {
      continue;
    }
    if (!info.may_open) {
      device.state = "no_permission";
      device.remedy = "install device/udev/";
      device.remedy += kUdevRule;
      device.remedy += " (cmake --install does), then plug the device in again";
    }
    found.push_back(std::move(device));
  }
  return found;
}

std::vector<FoundDevice> findPads() {
  std::vector<FoundDevice> found;
  for (const FoundGamepad& pad : findGamepads()) {
    FoundDevice device;
    device.kind = pad.rumbles ? "gamepad with rumble" : "gamepad without rumble";
    device.device = "gamepad:" + pad.path;
    device.info.product_name = pad.name;
    device.state = pad.may_open ? "ready" : "no_permission";
    if (!pad.may_open) device.remedy = "log in at this machine itself, or join the group input, then log in again";
    found.push_back(std::move(device));
  }
  return found;
}

std::vector<FoundDevice> findBridgedDevices() {
  std::vector<FoundDevice> found;
  for (const FoundBridge& bridge : findBridges()) {
    FoundDevice device;
    device.kind = "bridge";
    device.device = "bridge:" + bridge.path;
    device.state = bridge.listens ? "ready" : "not_running";
    if (!bridge.listens) device.remedy = "no program listens at this socket: start the bridge again";
    found.push_back(std::move(device));
  }
  return found;
}

bool isPluggedIn(UsbTransport& transport, const std::string& device) {
  if (device == "haply" || device.starts_with("haply:") || device.starts_with("haply,")) {
    const HaplyOptions options = haplyOptions(device.substr(5));
    const HaplyServiceState service = askHaplyService(options, kServiceTime_s);
    return std::any_of(service.devices.begin(), service.devices.end(), [&](const HaplyServiceState::Device& one) {
      return options.id.empty() || one.id == options.id;
    });
  }
  if (device == "gamepad" || device.starts_with("gamepad:")) {
    const std::vector<FoundGamepad> pads = findGamepads();
    return std::any_of(pads.begin(), pads.end(), [&](const FoundGamepad& pad) {
      return pad.may_open && (device == "gamepad" || device == "gamepad:" + pad.path);
    });
  }
  // "falcon:FIRMWARE" is a "falcon"; "spacemouse" matches any "spacemouse:1-2".
  const auto names = [&device](const std::string& found) {
    return device == found || device.starts_with(found + ":") || found.starts_with(device + ":");
  };
  const std::vector<FoundDevice> found = findDevices(transport);
  return std::any_of(found.begin(), found.end(),
                     [&](const FoundDevice& one) { return one.info.may_open && names(one.device); });
}

DeviceCheck checkDevice(HapticDevice& device, const DeviceCheckOptions& options) {
  const auto tell = [&options](const std::string& text) {
    if (options.tell) options.tell(text);
  };
  const Opened opened(device);
  const DeviceCapabilities& capabilities = device.capabilities();
  DeviceChecker checker(options, capabilities.peak_force_N > 0);
  const Clock::time_point start = Clock::now();
  HapticLoop loop(
      device, [&checker](const DeviceState& state, double dt_s) { return checker.tick(state, dt_s, Clock::now()); });
  loop.start();
  bool told_to_home = false, told_to_hold = false;
  std::string told_advice;
  double homing_s = 0;
  while (loop.running() && !checker.over()) {
    throwIfInterrupted();
    if (!checker.ready()) {
      homing_s = std::chrono::duration<double>(Clock::now() - start).count();
      if (const std::string advice = device.advice(); !advice.empty()) {
        if (advice != told_advice) tell(advice);
        told_advice = advice;
      } else if (!told_to_home && homing_s > 0.1) {
        tell("homing: pull the grip all the way out, then push it all the way in");
        told_to_home = true;
      }
      if (homing_s > options.homing_s)
        throw DeviceError(capabilities.name + ": was not homed in time; " +
                          (told_advice.empty() ? "try again" : told_advice));
    } else if (!told_to_hold) {
      if (capabilities.rate_control) tell("push and turn the cap, press its buttons");
      if (capabilities.peak_force_N > 0) tell("hold the grip loosely: a small force will act along x, y and z");
      told_to_hold = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  loop.stop();
  if (!loop.fault().empty()) throw DeviceError(capabilities.name + ": " + loop.fault());
  DeviceCheck check = checker.found();
  check.homing_s = capabilities.needs_homing ? homing_s : 0;
  check.refusals = loop.refusals();
  check.reports = check.exchanges;
  if (const auto* mouse = dynamic_cast<const SpaceMouse*>(&device)) check.reports = mouse->reports();
  if (const auto* falcon = dynamic_cast<const Falcon*>(&device)) check.reports = falcon->counters().reports;
  if (const auto* haply = dynamic_cast<const HaplyDevice*>(&device)) check.reports = haply->counters().states;
  if (options.walk) check.walk = walkThrough(device, options, tell);
  return check;
}

}  // namespace filiform::tools
