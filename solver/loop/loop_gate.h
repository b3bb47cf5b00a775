// What the haptic loop does with forces and states, without threads and clocks: when a force is too old to be sent,
// when a state is too old to be believed, and what is sent instead.
//
//   LoopGate gate(options);
//   if (too_old) gate.interrupt();
//   DeviceState state = device.exchange(gate.wrench());
//   const double dt_s = gate.take(state, now_s);               // fills in state.sent_N
//   gate.put(tick(state, dt_s), withheld);
//
// Times `now_s` are of any clock that does not stand still. Thread rule: haptic thread only; noexcept but for the
// constructor, without allocation.
#pragma once

#include "device/haptic_device.h"
#include "solver/force/force_gate.h"
#include "solver/loop/tick_clock.h"

namespace filiform {

struct LoopGateOptions {
  double period_s = 0.001;  // > 0
  // A device whose time stands still for longer (s) is taken for dead: zero force until it moves again. 0: never.
  double watchdog_s = 0.015;
  double ramp_s = 0.5;        // >= 0; after an interruption, a stale state and withheld force
  double fade_s = 0.05;       // >= 0; at the end of the loop
  bool ramp_at_start = true;  // at the first ready state too; not where the tick does that itself
};

class LoopGate {
 public:
  // Throws UsageError for an option out of its range or not finite.
  explicit LoopGate(const LoopGateOptions& options);

  // What is to be sent with the next exchange.
  const Wrench& wrench() const noexcept { return wrench_; }
  // The force has become too old, or another thread has sent zero meanwhile: zero, then the ramp.
  void interrupt() noexcept { wrench_ = gate_.close(); }
  // After an exchange: the time step of the state. A state without sent_N is given wrench().force_N.
  double take(DeviceState& state, double now_s) noexcept;
  // What the tick computed with that state: becomes wrench(), or zero if the state is stale or not ready, if the wrench
  // is not finite, or while force is withheld.
  void put(const Wrench& wanted, bool withheld) noexcept;
  // The loop ends: from the next put() on the force fades.
  void end() noexcept { gate_.restart(); }
  // Nothing is left of it.
  bool ended() const noexcept { return !gate_.fading(); }

  // The last state taken: its device's clock has stood still for longer than watchdog_s.
  bool stale() const noexcept { return stale_; }

 private:
  LoopGateOptions options_;
  ForceGate gate_;
  TickClock clock_;
  Wrench wrench_;
  double last_s_ = 0, now_s_ = 0, moved_s_ = 0, device_time_s_ = 0;
  bool taken_ = false, ready_ = false, was_ready_ = false, stale_ = false;
};

}  // namespace filiform
