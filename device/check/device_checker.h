// The part of the device test that runs on the haptic thread: reads the device for a while, then ramps a small force
// along each axis in turn.
// Thread rule: tick() on the haptic thread; ready() and over() on any thread; found() after over() is true or the loop
// has ended.
#pragma once

#include "device/check/device_check.h"

#include <atomic>
#include <chrono>

namespace filiform::tools {

class DeviceChecker {
 public:
  using Clock = std::chrono::steady_clock;

  DeviceChecker(const DeviceCheckOptions& options, bool renders_force);

  // Returns the force to render. `dt_s`: time since the previous tick, as the loop counts it. `now`: when the state was
  // read. O(1), no allocation.
  Wrench tick(const DeviceState& state, double dt_s, Clock::time_point now) noexcept;

  bool ready() const noexcept { return ready_.load(std::memory_order_acquire); }  // homed, if the device needs homing
  bool over() const noexcept { return over_.load(std::memory_order_acquire); }
  const DeviceCheck& found() const noexcept { return found_; }

 private:
  enum class Phase { homing, reading, force, over };

  void begin(Phase phase, Clock::time_point now) noexcept;
  void read(Clock::time_point now) noexcept;
  Wrench push(const DeviceState& state, double dt_s) noexcept;

  const DeviceCheckOptions options_;
  const bool renders_force_;
  DeviceCheck found_;
  std::atomic<bool> ready_{false}, over_{false};
  Phase phase_ = Phase::homing;
  double elapsed_s_ = 0;  // in the ramp along this axis
  Clock::time_point began_, last_;
  Eigen::Vector3d start_D_ = Eigen::Vector3d::Zero();
  int axis_ = 0;
};

}  // namespace filiform::tools
