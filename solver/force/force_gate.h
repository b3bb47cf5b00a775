// Limits a computed force before it goes to the device, in this order. The force is zero if none may act. The result
// depends only on the inputs and on earlier calls: the gate uses neither a clock nor a device.
//
//   step   what it limits                                      force   torque  local model
//   clamp  the size                                            scaled  as is   scaled
//   fade   falls to zero before a jump or change of mode       scaled  scaled  none
//   slew   how fast the force grows                            scaled  as is   scaled
//   ramp   grows from zero after a start (force_ramp.h)        scaled  scaled  scaled
//
//   ForceGate gate(options);
//   Wrench sent = gate.pass({.wanted = wrench, .dt_s = dt_s});     // once a tick
//   gate.close();     // zero now; then force grows from zero over the ramp
//   gate.restart();   // what is sent now fades to zero; then force grows from zero over the ramp
//
// Two gates act in a row. The force law's gate applies clamp, slew limit, and fade and ramp at a command. The haptic
// loop's gate sends zero for a stale state, while force is withheld and after an interruption, and fades the force at
// the end of the loop. Thread rule: haptic thread only; a copy is a snapshot of the whole state.
#pragma once

#include "device/haptic_device.h"
#include "index/errors.h"

#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace filiform {

struct ForceGateOptions {
  double max_force_N = std::numeric_limits<double>::infinity();   // > 0; a larger force is scaled to this size
  double max_slew_N_s = std::numeric_limits<double>::infinity();  // > 0; of growth; a force that falls is not delayed
  double ramp_s = 0.5;                                            // >= 0; time in which the factor grows from 0 to 1
  double fade_s = 0.05;                                           // >= 0; time from the force to zero; 0: at once
  double max_fade_N_s = 100;                                      // > 0; a force above max_fade_N_s fade_s takes longer
};

class ForceGate {
 public:
  struct Input {
    Wrench wanted{};
    double dt_s = 0;    // since the last call; counts as 0 unless > 0 and finite
    double free_N = 0;  // >= 0; growth (N) in this tick that the hand's own motion causes: free of the slew limit
    // Not ready: zero, and the ramp continues. Stale (the device's state is old) or withheld (the caller lets no force
    // act): zero, and the ramp begins anew.
    bool ready = true, stale = false, withheld = false;
  };
  struct Events {  // numbers of calls of pass() in which the limit acted, since construction
    std::uint64_t clamped = 0, slewed = 0;
  };

  // Throws UsageError for an option that is out of range or NaN. `open`: without a ramp at the
  // begin; the other limits apply.
  explicit ForceGate(const ForceGateOptions& options, bool open = false);

  // Returns the wrench to send now. It is finite, and zero if the wanted wrench is not. The size of its force is at
  // most max_force_N, and at most (max_slew_N_s + max_force_N / ramp_s) dt_s + free_N above that of the last force;
  // after the ramp its term is absent. During a fade the wanted force passes, but its size is at most that of the rest
  // of the fading force and that of the force sent last. O(1), no allocation.
  Wrench pass(const Input& input) noexcept;
  // Returns zero and ends a fade. The next force grows from zero at the slew limit; the ramp continues.
  Wrench cut() noexcept;
  // Returns zero and ends a fade. The next force grows from zero over the ramp.
  Wrench close() noexcept;
  // Begins a fade: in the next calls of pass(), the force sent last falls to zero over fade_s, or over |force| /
  // max_fade_N_s if that is longer. Then force grows over the ramp.
  void restart() noexcept;

  bool fading() const noexcept { return fade_s_ > 0; }
  // The fading force (N, frame D) at `dt_s` from now; zero at the end of the fade. Requires fading().
  Eigen::Vector3d faded_N(double dt_s) const noexcept;

  const Wrench& sent() const noexcept { return sent_; }
  const Events& events() const noexcept { return events_; }
  const ForceGateOptions& options() const noexcept { return options_; }

 private:
  double partOf(double dt_s) const noexcept;  // the part (0..1) of the fading force that remains after dt_s

  ForceGateOptions options_;
  Events events_;
  Wrench sent_;
  Eigen::Vector3d slewed_N_ =
      Eigen::Vector3d::Zero();  // the last force after clamp and slew limit, without the factor of the ramp
  Eigen::Vector3d fading_N_ = Eigen::Vector3d::Zero();
  double fade_s_ = 0, faded_s_ = 0;  // duration of the fade (0: none); time since its start
  double ramped_s_ = 0;
  bool ramp_begun_ = false;
};

}  // namespace filiform
