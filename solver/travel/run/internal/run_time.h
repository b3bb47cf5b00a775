// The time of a run, counted in periods of the requested rate. The count is exact if each tick takes one period, as in
// virtual time. Thread rule: thread-compatible; haptic-safe.
#pragma once

#include <algorithm>
#include <cmath>

namespace filiform::internal {

class RunTime {
 public:
  // Requires rate_Hz > 0 and finite.
  explicit RunTime(double rate_Hz) noexcept : rate_Hz_(rate_Hz), period_s_(1.0 / rate_Hz), step_s_(period_s_) {}

  double period_s() const noexcept { return period_s_; }
  double step_s() const noexcept { return step_s_; }  // of the current tick
  double step_periods() const noexcept { return step_periods_; }
  double periods() const noexcept { return periods_; }  // passed so far
  double now_s() const noexcept { return periods_ * period_s_; }

  void setStep(double step_s) noexcept {
    step_s_ = step_s;
    step_periods_ = step_s == period_s_ ? 1.0 : step_s / period_s_;
  }
  // Adds the time of the current tick.
  void pass() noexcept { periods_ += step_periods_; }

  // A duration in whole periods, rounded up, at most 1e15; 0 for a time that is negative or not a number.
  double periodsOf(double time_s) const noexcept {
    const double periods = std::ceil(time_s * rate_Hz_);
    return periods >= 0 ? std::min(1e15, periods) : 0.0;
  }

 private:
  double rate_Hz_, period_s_, step_s_, step_periods_ = 1, periods_ = 0;
};

}  // namespace filiform::internal
