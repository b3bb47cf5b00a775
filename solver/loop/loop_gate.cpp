#include "solver/loop/loop_gate.h"

#include "solver/force/internal/option_check.h"

namespace filiform {

using internal::isNotNegative;
using internal::isPositive;
using internal::require;

LoopGate::LoopGate(const LoopGateOptions& options)
    : options_(options),
      gate_({.ramp_s = options.ramp_s, .fade_s = options.fade_s}, !options.ramp_at_start),
      clock_(options.period_s) {
  require(isPositive(options.period_s), "period of the haptic loop (s)", options.period_s, "> 0");
  require(isNotNegative(options.watchdog_s), "watchdog of the haptic loop (s)", options.watchdog_s, ">= 0");
}

double LoopGate::take(DeviceState& state, double now_s) noexcept {
  if (!state.sent_N) state.sent_N = wrench_.force_N;
  if (!taken_ || state.time_s != device_time_s_) moved_s_ = now_s;
  last_s_ = taken_ ? now_s_ : now_s;
  now_s_ = now_s;
  device_time_s_ = state.time_s;
  taken_ = true;
  stale_ = options_.watchdog_s > 0 && now_s - moved_s_ > options_.watchdog_s;
  was_ready_ = ready_;
  ready_ = state.status == DeviceStatus::ready;
  if (ready_ && !was_ready_ && options_.ramp_at_start) gate_.close();
  return clock_.step_s(state.time_s);
}

void LoopGate::put(const Wrench& wanted, bool withheld) noexcept {
  ForceGate::Input input;
  input.wanted = wanted;
  input.dt_s = now_s_ - last_s_;
  input.ready = ready_;
  input.stale = stale_;
  input.withheld = withheld;
  wrench_ = gate_.pass(input);
}

}  // namespace filiform
