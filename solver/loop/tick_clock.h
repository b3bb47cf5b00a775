// The time step of a tick, from the times of the device's states.
//
//   TickClock clock(1 / rate_Hz);
//   const double dt_s = clock.step_s(state.time_s);      // once for each state
//
// A step is the time between two states, at most mostStep_s(). So a pause of the device or the machine is one long
// tick, not a jump in time. If the device's clock stands still, a tick counts as one period, and the next steps are
// shorter by that time. A step within 1 ns of the period becomes exactly the period, so that a simulated hand gives
// constant steps. Thread rule: thread-compatible. All members except the constructor are noexcept and do not allocate.
#pragma once

#include <algorithm>
#include <cmath>

namespace filiform {

class TickClock {
 public:
  // Requires period_s > 0 and finite.
  explicit TickClock(double period_s) noexcept : period_s_(period_s) {}

  // The longest step (s): 10 ms, the greatest age of a force, but at least 2 periods.
  double mostStep_s() const noexcept { return std::max(0.010, 2 * period_s_); }

  // Finite, from 0 to mostStep_s(). The period for the first state, and if the time is not finite or runs backwards.
  double step_s(double time_s) noexcept {
    const double elapsed_s = known_ ? time_s - last_s_ : period_s_;
    known_ = std::isfinite(time_s);
    if (known_) last_s_ = time_s;
    if (!(elapsed_s >= 0 && std::isfinite(elapsed_s))) {
      lent_s_ = 0;
      return period_s_;
    }
    if (elapsed_s == 0) {
      lent_s_ = std::min(lent_s_ + period_s_, mostStep_s());
      return period_s_;
    }
    if (lent_s_ == 0 && std::abs(elapsed_s - period_s_) <= 1e-9) return period_s_;
    const double step_s = std::clamp(elapsed_s - lent_s_, 0.0, mostStep_s());
    lent_s_ = std::max(0.0, lent_s_ - elapsed_s);
    return step_s;
  }

 private:
  double period_s_, last_s_ = 0, lent_s_ = 0;
  bool known_ = false;
};

}  // namespace filiform
