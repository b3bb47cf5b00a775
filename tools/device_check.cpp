#include "tools/device_check.h"

#include "device/falcon.h"
#include "device/spacemouse.h"
#include "solver/haptic_loop.h"
#include "tools/cli.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

using Eigen::Vector3d;
using Clock = std::chrono::steady_clock;

// The haptic thread's part. What it writes is read when `over` is set, or after the loop.
class Checker {
 public:
  explicit Checker(const DeviceCheckOptions& options, bool renders_force)
      : options_(options), renders_force_(renders_force) {}

  Wrench tick(const DeviceState& state, double dt_s) noexcept {
    Wrench wrench;
    if (state.status == DeviceStatus::closed) phase_ = Phase::over;  // a recording that has ended
    if (state.status == DeviceStatus::ready) {
      check.buttons |= state.buttons;
      if (phase_ == Phase::homing) {
        ready.store(true, std::memory_order_release);
        begin(Phase::reading);
      } else if (phase_ == Phase::reading) {
        read();
      } else if (phase_ == Phase::force) {
        wrench = push(state, dt_s);
      }
    }
    if (phase_ == Phase::over) over.store(true, std::memory_order_release);
    return wrench;
  }

  DeviceCheck check;
  std::atomic<bool> ready{false}, over{false};

 private:
  enum class Phase { homing, reading, force, over };

  void begin(Phase phase) noexcept {
    phase_ = phase;
    elapsed_s_ = 0;
    last_ = began_ = Clock::now();
  }

  void read() noexcept {
    const Clock::time_point now = Clock::now();
    ++check.exchanges;
    check.longest_gap_s = std::max(check.longest_gap_s, std::chrono::duration<double>(now - last_).count());
    last_ = now;
    check.seconds = std::chrono::duration<double>(now - began_).count();
    if (check.seconds < options_.read_s) return;
    check.rate_Hz = static_cast<double>(check.exchanges) / check.seconds;
    begin(renders_force_ ? Phase::force : Phase::over);
  }

  Wrench push(const DeviceState& state, double dt_s) noexcept {
    if (elapsed_s_ == 0) start_D_ = state.p_D;
    elapsed_s_ += dt_s;
    const Vector3d moved_m = state.p_D - start_D_;
    check.moved_m[axis_] = std::max(check.moved_m[axis_], moved_m[axis_]);
    check.stopped = !(moved_m.norm() <= options_.most_moved_m);
    if (elapsed_s_ >= options_.ramp_s) {
      elapsed_s_ = 0;
      ++axis_;
    }
    if (check.stopped || axis_ == 3) {
      phase_ = Phase::over;
      return {};
    }
    Wrench wrench;
    const double share = 1 - std::abs(2 * elapsed_s_ / options_.ramp_s - 1);
    wrench.force_N[axis_] = share * options_.force_N;
    check.force_N = std::max(check.force_N, wrench.force_N[axis_]);
    return wrench;
  }

  const DeviceCheckOptions& options_;
  bool renders_force_;
  Phase phase_ = Phase::homing;
  double elapsed_s_ = 0;
  Clock::time_point began_, last_;
  Vector3d start_D_ = Vector3d::Zero();
  int axis_ = 0;
};

struct Opened {
  explicit Opened(HapticDevice& what) : device(what) { device.open(); }
  ~Opened() { device.close(); }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  HapticDevice& device;
};

}  // namespace

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
            ", or give falcon:FILE; the device's owner has it with Novint's driver. Not needed while the device keeps "
            "what was loaded since it got power";
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

DeviceCheck checkDevice(HapticDevice& device, const DeviceCheckOptions& options) {
  const auto tell = [&options](const std::string& text) {
    if (options.tell) options.tell(text);
  };
  const Opened opened(device);
  const DeviceCapabilities& capabilities = device.capabilities();
  Checker checker(options, capabilities.peak_force_N > 0);
  const Clock::time_point start = Clock::now();
  HapticLoop loop(device, [&checker](const DeviceState& state, double dt_s) { return checker.tick(state, dt_s); });
  loop.start();
  bool told_to_home = false, told_to_hold = false;
  double homing_s = 0;
  while (loop.running() && !checker.over.load(std::memory_order_acquire)) {
    throwIfInterrupted();
    if (!checker.ready.load(std::memory_order_acquire)) {
      homing_s = std::chrono::duration<double>(Clock::now() - start).count();
      if (!told_to_home && homing_s > 0.1) {
        tell("homing: pull the grip all the way out, then push it all the way in");
        told_to_home = true;
      }
      if (homing_s > options.homing_s) throw DeviceError(capabilities.name + ": it was not homed in time; try again");
    } else if (!told_to_hold) {
      if (capabilities.rate_control) tell("push and turn the cap, press its buttons");
      if (capabilities.peak_force_N > 0) tell("hold the grip loosely: a small force follows along x, y and z");
      told_to_hold = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  loop.stop();
  if (!loop.fault().empty()) throw DeviceError(capabilities.name + ": " + loop.fault());
  DeviceCheck check = checker.check;
  check.homing_s = capabilities.needs_homing ? homing_s : 0;
  check.refusals = loop.refusals();
  check.reports = check.exchanges;
  if (const auto* mouse = dynamic_cast<const SpaceMouse*>(&device)) check.reports = mouse->reports();
  if (const auto* falcon = dynamic_cast<const Falcon*>(&device)) check.reports = falcon->counters().reports;
  return check;
}

}  // namespace filiform::tools
