#include "device/check/device_checker.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {

DeviceChecker::DeviceChecker(const DeviceCheckOptions& options, bool renders_force)
    : options_(options), renders_force_(renders_force) {}

Wrench DeviceChecker::tick(const DeviceState& state, double dt_s, Clock::time_point now) noexcept {
  Wrench wrench;
  if (state.status == DeviceStatus::closed) phase_ = Phase::over;  // end of a recording
  if (state.status == DeviceStatus::ready) {
    found_.buttons |= state.buttons;
    if (phase_ == Phase::homing) {
      ready_.store(true, std::memory_order_release);
      begin(Phase::reading, now);
    } else if (phase_ == Phase::reading) {
      read(now);
    } else if (phase_ == Phase::force) {
      wrench = push(state, dt_s);
    }
  }
  if (phase_ == Phase::over) over_.store(true, std::memory_order_release);
  return wrench;
}

void DeviceChecker::begin(Phase phase, Clock::time_point now) noexcept {
  phase_ = phase;
  elapsed_s_ = 0;
  last_ = began_ = now;
}

void DeviceChecker::read(Clock::time_point now) noexcept {
  ++found_.exchanges;
  found_.longest_gap_s = std::max(found_.longest_gap_s, std::chrono::duration<double>(now - last_).count());
  last_ = now;
  found_.seconds = std::chrono::duration<double>(now - began_).count();
  if (found_.seconds < options_.read_s) return;
  found_.rate_Hz = static_cast<double>(found_.exchanges) / found_.seconds;
  begin(renders_force_ ? Phase::force : Phase::over, now);
}

Wrench DeviceChecker::push(const DeviceState& state, double dt_s) noexcept {
  if (elapsed_s_ == 0) start_D_ = state.p_D;
  elapsed_s_ += dt_s;
  const Eigen::Vector3d moved_m = state.p_D - start_D_;
  found_.moved_m[axis_] = std::max(found_.moved_m[axis_], moved_m[axis_]);
  found_.stopped = !(moved_m.norm() <= options_.most_moved_m);
  if (elapsed_s_ >= options_.ramp_s) {
    elapsed_s_ = 0;
    ++axis_;
  }
  if (found_.stopped || axis_ == 3) {
    phase_ = Phase::over;
    return {};
  }
  Wrench wrench;
  const double share = 1 - std::abs(2 * elapsed_s_ / options_.ramp_s - 1);
  wrench.force_N[axis_] = share * options_.force_N;
  found_.force_N = std::max(found_.force_N, wrench.force_N[axis_]);
  return wrench;
}

}  // namespace filiform::tools
