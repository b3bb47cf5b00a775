#include "solver/loop/device_test.h"

#include "device/check/device_checker.h"
#include "device/falcon/falcon.h"
#include "device/haply/haply_device.h"
#include "device/spacemouse/spacemouse.h"
#include "solver/loop/device_setup.h"
#include "solver/loop/haptic_loop.h"

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>

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

constexpr double kPatience_s = 10;       // for a push of the handle
constexpr double kSweepLimit_N_m = 200;  // of a device that states no stiffness

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
    if (options.poll) options.poll();
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
    if (options.poll) options.poll();
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
  if (options.directions && !capabilities.rate_control)
    check.wrong_direction = checkDirections(device, options, kPatience_s);
  if (options.walk) check.walk = walkThrough(device, options, tell);
  return check;
}

}  // namespace filiform::tools
