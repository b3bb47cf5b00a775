// All that stands between a force that was computed and the device: zero where no force may act, clamp, slew limit,
// fade and ramp. A pure function of its inputs and of what it let through before: no clock, no device.
//
//   ForceGate gate(options);
//   Wrench sent = gate.pass({.wanted = wrench, .dt_s = dt_s});     // once a tick
//   gate.close();     // zero now; later force grows from zero over the ramp
//   gate.restart();   // what is sent now fades to zero; then force grows from zero over the ramp
//
// Two gates act in a row: the force law's (clamp, slew limit, fade and ramp at a command) and the haptic loop's (zero
// at a stale state, while force is withheld and after an interruption; fade at the end of the loop). Thread rule:
// haptic thread only; a copy is a snapshot of the whole state.
#pragma once

#include "device/haptic_device.h"

#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace filiform {

struct ForceGateOptions {
  double max_force_N = std::numeric_limits<double>::infinity();   // > 0: a longer force is shortened, direction kept
  double max_slew_N_s = std::numeric_limits<double>::infinity();  // > 0: of an increase; a fall is never delayed
  double ramp_s = 0.5;                                            // >= 0: from zero to the whole force
  double fade_s = 0.05;                                           // >= 0: from the whole force to zero
  double max_fade_N_s = 100;                                      // > 0: a strong force takes longer to fade
};

class ForceGate {
 public:
  struct Input {
    Wrench wanted{};
    double dt_s = 0;    // since the last call; counts as 0 unless > 0 and finite
    double free_N = 0;  // >= 0: increase that the slew limit lets through, for the hand's own motion
    // No force may act: it is zero now. A state that is stale, and force that is withheld, restart the ramp too.
    bool ready = true, stale = false, withheld = false;
  };
  struct Events {  // calls, since construction
    std::uint64_t clamped = 0, slewed = 0;
  };

  // Throws UsageError for an option out of its range or NaN. `open`: the first force passes whole; else over the ramp.
  explicit ForceGate(const ForceGateOptions& options, bool open = false);

  // What may be sent now. Finite; zero for a wanted wrench that is not. Not longer than max_force_N, and longer than
  // the last one by at most (max_slew_N_s + max_force_N / ramp_s) dt_s + free_N. In a fade: not longer than what is
  // left of the fading force, nor than the force sent last. O(1), no allocation.
  Wrench pass(const Input& input) noexcept;
  // Zero now, and the next force starts at zero; the ramp goes on.
  Wrench cut() noexcept;
  // Zero now, and the next force grows from zero over the ramp.
  Wrench close() noexcept;
  // The force sent last falls to zero over fade_s, or |force| / max_fade_N_s where that is longer. The next force then
  // grows over the ramp.
  void restart() noexcept;

  bool fading() const noexcept { return fade_s_ > 0; }
  // The force of a fade `dt_s` from now, zero at its end. Requires fading().
  Eigen::Vector3d faded_N(double dt_s) const noexcept;

  const Wrench& sent() const noexcept { return sent_; }
  const Events& events() const noexcept { return events_; }
  const ForceGateOptions& options() const noexcept { return options_; }

 private:
  double partOf(double dt_s) const noexcept;  // of the fading force, after dt_s

  ForceGateOptions options_;
  Events events_;
  Wrench sent_;
  Eigen::Vector3d slewed_N_ = Eigen::Vector3d::Zero();  // the last force before the ramp
  Eigen::Vector3d fading_N_ = Eigen::Vector3d::Zero();
  double fade_s_ = 0, faded_s_ = 0;  // how long the fade takes (0: none), and how much of it is over
  double ramped_s_ = 0;
  bool ramp_begun_ = false;
};

}  // namespace filiform
