#include "solver/loop/device_setup.h"

#include "index/errors.h"
#include "solver/loop/haptic_loop.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <thread>

namespace filiform::tools {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPush_m = 0.03, kPushed_m = 0.02, kBack_m = 0.01;
constexpr std::array kForward{"to the right", "up", "towards you"}, kBackward{"to the left", "down", "away from you"};

// Reads an open device on its loop, without force.
class Watch {
 public:
  Watch(HapticDevice& device, const DeviceCheckOptions& options)
      : device_(device), options_(options), loop_(device, [this](const DeviceState& state, double) {
          for (std::size_t i = 0; i < 3; ++i) p_D_[i] = state.p_D[static_cast<Eigen::Index>(i)];
          buttons_ = state.buttons;
          ready_ = state.status == DeviceStatus::ready;
          if (leads_) device_.lead({aim_D_[0], aim_D_[1], aim_D_[2]});
          return Wrench{};
        }) {
    loop_.start();
  }
  ~Watch() { loop_.stop(); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  Eigen::Vector3d p_D() const { return {p_D_[0], p_D_[1], p_D_[2]}; }
  std::uint32_t buttons() const { return buttons_; }
  bool ready() const { return ready_; }
  void lead(const Eigen::Vector3d& aim_D) {
    for (std::size_t i = 0; i < 3; ++i) aim_D_[i] = aim_D[static_cast<Eigen::Index>(i)];
    leads_ = true;
  }
  template <typename Done>
  bool waitFor(const Done& done, double limit_s) {
    const auto end = Clock::now() + std::chrono::duration<double>(limit_s);
    while (!done()) {
      if (!loop_.running()) throw DeviceError(device_.capabilities().name + ": " + loop_.fault());
      if (options_.poll) options_.poll();
      if (Clock::now() >= end) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }

 private:
  HapticDevice& device_;
  const DeviceCheckOptions& options_;
  std::array<std::atomic<double>, 3> p_D_{}, aim_D_{};
  std::atomic<std::uint32_t> buttons_{0};
  std::atomic<bool> ready_{false}, leads_{false};
  HapticLoop loop_;  // last: its thread uses the others
};

void tellTo(const DeviceCheckOptions& options, const std::string& text) {
  if (options.tell) options.tell(text);
}

void waitUntilReady(HapticDevice& device, const DeviceCheckOptions& options) {
  Watch watch(device, options);
  std::string told;
  const auto isReady = [&] {
    if (const std::string advice = device.advice(); !watch.ready() && !advice.empty() && advice != told)
      tellTo(options, told = advice);
    return watch.ready();
  };
  if (!watch.waitFor([&] { return watch.ready(); }, 0.2) && device.capabilities().needs_homing)
    tellTo(options, "homing: pull the grip all the way out, then push it all the way in");
  if (!watch.waitFor(isReady, options.homing_s))
    throw DeviceError(device.capabilities().name + ": was not ready in time; " + (told.empty() ? "try again" : told));
}

ButtonAction askedAction(const DeviceSetupOptions& options, int button, ButtonAction proposed) {
  for (;;) {
    const std::string answer =
        options.ask ? options.ask("action of button " + std::to_string(button) + " [" + toString(proposed) + "]: ")
                    : std::string();
    if (answer.empty()) return proposed;
    try {
      return parseButtons("0=" + answer)[0];
    } catch (const UsageError&) {
      tellTo(options.check, "'" + answer + "' is no action; choose one of " + buttonActionNames() + ", none");
    }
  }
}

}  // namespace

std::string checkDirections(HapticDevice& device, const DeviceCheckOptions& options, double patience_s) {
  Watch watch(device, options);
  if (!watch.waitFor([&] { return watch.ready(); }, patience_s)) return "";
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const Eigen::Vector3d rest_D = watch.p_D();
    const auto moved = [&] { return (watch.p_D() - rest_D).eval(); };
    tellTo(options, std::string("push the handle 3 cm ") + kForward[i] + ", then let it come back");
    watch.lead(rest_D + kPush_m * Eigen::Vector3d::Unit(axis));
    if (!watch.waitFor([&] { return moved().cwiseAbs().maxCoeff() > kPushed_m; }, patience_s)) return "";
    int seen = 0;
    const Eigen::Vector3d went_m = moved();
    went_m.cwiseAbs().maxCoeff(&seen);
    const auto k = static_cast<std::size_t>(seen);
    if (seen != axis || went_m[seen] < 0)
      return device.capabilities().name + ": pushed " + kForward[i] + ", the handle was seen to go " +
             (went_m[seen] < 0 ? kBackward[k] : kForward[k]) + ": " +
             (device.capabilities().name.find("Haply") != std::string::npos
                  ? "set handedness and mount in the Haply Inverse Service"
                  : "see how the device stands, and how its driver or bridge turns the axes");
    watch.lead(rest_D);
    watch.waitFor([&] { return moved().norm() < kBack_m; }, patience_s);
  }
  return "";
}

ButtonMap setUpDevice(HapticDevice& device, const DeviceSetupOptions& options) {
  struct Opened {
    explicit Opened(HapticDevice& what) : device(what) { device.open(); }
    ~Opened() { device.close(); }
    HapticDevice& device;
  } const opened(device);
  waitUntilReady(device, options.check);
  const DeviceCapabilities& can = device.capabilities();
  if (!can.rate_control)
    if (const std::string wrong = checkDirections(device, options.check, options.patience_s); !wrong.empty())
      throw DeviceError(wrong);
  const ButtonMap proposed = defaultButtons(can);
  const int count = std::min(can.buttons, static_cast<int>(proposed.size()));
  ButtonMap map{};
  Watch watch(device, options.check);
  // A simulated hand that is led presses its button while it is away.
  if (can.is_led) watch.lead(watch.p_D() - kPush_m * Eigen::Vector3d::UnitZ());
  if (count == 0) tellTo(options.check, can.name + " has no buttons");
  for (std::uint32_t known = 0, all = (1U << count) - 1; known != all;) {
    tellTo(options.check, known == 0 ? "press a button" : "press another button");
    if (!watch.waitFor([&] { return (watch.buttons() & all & ~known) != 0; }, options.patience_s)) {
      tellTo(options.check, "no further button was pressed: the others do nothing");
      break;
    }
    const int button = std::countr_zero(watch.buttons() & all & ~known);
    map[static_cast<std::size_t>(button)] = askedAction(options, button, proposed[static_cast<std::size_t>(button)]);
    known |= 1U << button;
  }
  return map;
}

}  // namespace filiform::tools
