// The rules of the haptic loop for forces and states, without threads and clocks: when a force is too old to be sent,
// when a state is too old to be used, and what is sent instead.
//
//   LoopGate gate(options);
//   if (too_old) gate.interrupt();
//   DeviceState state = device.exchange(gate.wrench());
//   const double dt_s = gate.take(state, now_s);               // fills in state.sent_N
//   gate.put(tick(state, dt_s), withheld);
//
// Times `now_s` are of any steady clock. Thread rule: haptic thread only. All members except the constructor are
// noexcept and do not allocate.
#pragma once

#include "device/haptic_device.h"
#include "solver/force/force_gate.h"
#include "solver/loop/tick_clock.h"

namespace filiform {

struct LoopGateOptions {
  double period_s = 0.001;  // > 0
  // If the device's time stands still for longer than this (s), the force is zero until it moves again. 0: never.
  double watchdog_s = 0.015;
  double ramp_s = 0.5;        // >= 0; ramp after an interruption, a stale state and withheld force
  double fade_s = 0.05;       // >= 0; fade at the end of the loop
  bool ramp_at_start = true;  // ramp at the first ready state too; false if the tick has its own ramp
};

class LoopGate {
 public:
  // Throws UsageError for an option that is out of range or not finite.
  explicit LoopGate(const LoopGateOptions& options);

  // The wrench for the next exchange.
  const Wrench& wrench() const noexcept { return wrench_; }
  // The force has become too old, or another thread has sent zero: send zero, then ramp.
  void interrupt() noexcept { wrench_ = gate_.close(); }
  // After an exchange: returns the time step of the state. Sets state.sent_N to wrench().force_N if the device did not
  // set it.
  double take(DeviceState& state, double now_s) noexcept;
  // Sets wrench() to the tick's result; to zero if the state is stale or not ready, if the wrench is not finite, or
  // while force is withheld.
  void put(const Wrench& wanted, bool withheld) noexcept;
  // Begins the end of the loop: the force fades from the next put() on.
  void end() noexcept { gate_.restart(); }
  // The fade is over.
  bool ended() const noexcept { return !gate_.fading(); }

  // The device's clock has stood still for longer than watchdog_s, as of the last take().
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
