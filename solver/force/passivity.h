// Bounds the energy that rendering gives to the hand, whatever proxy, rate, delay and hand do: an observer and a
// controller in the time domain (after Hannaford and Ryu 2002, with a second stage that makes the bound strict).
//
//   controller.apply(force, h, stored, ..., dt)   ->  limits of the force law  ->  controller.sent(force)
//
// The observer keeps E (J), the energy that the renderer has received from the hand. From one tick to the next, the
// hand moves by dh while the force that was sent `delay` ticks earlier acts: E falls by f . dh. This is exact for a
// force that is constant during the period. Three rules make E a budget:
//   ceiling    E is at most the energy in the spring now. Energy that is lost when the proxy finds a nearer place is
//              dissipated, not saved for later.
//   allowance  Below zero, E recovers by power_W: the controller forgets a deficit at no more than this power.
//   start      After a start, jump or change of mode, E is the energy in the spring, plus the energy of a spring that
//              pulls with the fading force: such a command brings its own energy.
// If E < 0 and the controller is on, it does two things.
// 1. It damps: f -= a v with a = min(max_damping, -E / (dt v^2)), the damping that removes the deficit within a period.
// 2. It weakens: f *= w, with w at most 1 + E / energy_J, so no force is left at E = -energy_J. This rule alone holds
//    if the damping reaches its cap, or if the hand reverses faster than the delay lets damping act. The factor w falls
//    at once and rises by at most recovery_1_s. If w followed E in both directions, the force would stiffen by F^2 /
//    energy_J and vibrate by itself. With slow recovery the force is weaker on the way back than on the way out, and
//    dissipates energy.
//
// Invariant, with the controller on and forces of at most F: at every tick
//   E >= -energy_J - (delay + 1) F s,   s the longest step of the hand in a tick.
// So over any time t without a start, the hand receives at most the energy in the spring at its begin, plus energy_J +
// power_W t + (delay + 1) F s. This makes no assumption about the hand, the proxy or the regularity of ticks. It
// assumes that `delay` is the device's delay, that positions are true, and that the device renders the force that it is
// sent.
//
// Sometimes it is unknown which force acted while the hand moved: if the hand moves after several equal states, or if
// a force was taken away between two states. Then each axis counts the force that gives most. So E is too low rather
// than too high, if the hand does not turn back in between.
//
// When the workspace moves under the hand, it does work that is bounded separately (FORCES.md); carried() excludes this
// work from E. Thread rule: haptic thread only; a copy is a snapshot of the whole state.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace filiform {

struct PassivityOptions {
  static constexpr int kMaxDelay = 8;

  bool on = false;              // false: only observe
  double energy_J = 1e-3;       // > 0; the deficit at which no force is left
  double power_W = 1e-4;        // >= 0; the deficit that is forgotten each second
  double recovery_1_s = 0.2;    // > 0; rate at which a weakened force recovers
  double max_damping_Ns_m = 5;  // >= 0; the hand feels the device's velocity noise times this
  int delay_samples = 1;        // 0 .. kMaxDelay; ticks between the command of a force and its effect
};

struct PassivityEnergy {     // J, since construction
  double observed = 0;       // E now
  double least = 0;          // lowest E so far
  double injected = 0;       // sum of the energy that moves of the proxy have added to the spring
  double injected_most = 0;  // the most that one such move has added
  double weakest = 1;        // lowest w so far; no unit
  std::uint64_t acted = 0;   // number of ticks in which the controller changed the force
};

class PassivityController {
 public:
  // Throws UsageError for an option that is out of range or not finite.
  explicit PassivityController(const PassivityOptions& options);

  // One tick: observes the motion to h_D. Returns the force (N) to send instead of `force_N`. `stored_J` and
  // `stored_by_last_proxy_J` are the energy in the spring at this probe, with the proxy now and with the proxy of the
  // last tick, both >= 0. Requires finite vectors. A dt_s that is not > 0 and finite counts as no time.
  Eigen::Vector3d apply(const Eigen::Vector3d& force_N, const Eigen::Vector3d& h_D, double stored_J,
                        double stored_by_last_proxy_J, double dt_s) noexcept;
  // Reports the force that was commanded after all limits. Once a tick.
  void sent(const Eigen::Vector3d& force_N) noexcept;
  // Reports the force that the device was really sent instead of the force of the last sent(). Call before the next
  // apply(). Zero instead of another force also means that it is unknown how long the earlier forces acted.
  void acted(const Eigen::Vector3d& force_N) noexcept;
  // Reports that the world has moved under the device since the last tick: the p_D of every point fell by `shift_D`.
  void carried(const Eigen::Vector3d& shift_D) noexcept { carried_D_ += shift_D; }
  // For a start, jump or change of mode.
  void restart() noexcept { started_ = false; }

  const PassivityOptions& options() const { return options_; }
  const PassivityEnergy& energy() const { return energy_; }

 private:
  static inline const Eigen::Vector3d kNone = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());

  PassivityOptions options_;
  PassivityEnergy energy_;
  std::array<Eigen::Vector3d, PassivityOptions::kMaxDelay + 1> sent_N_;  // oldest at at_
  int at_ = 0;
  void mayHaveActed(const Eigen::Vector3d& force_N) noexcept;
  double given(const Eigen::Vector3d& dh_D) noexcept;

  Eigen::Vector3d h_D_ = Eigen::Vector3d::Zero(), carried_D_ = Eigen::Vector3d::Zero();
  // Lower and upper limit of the forces that may have acted since the hand last moved; lo > hi: none yet.
  Eigen::Vector3d lo_N_ = kNone, hi_N_ = -kNone;
  int doubtful_ = 0;  // for this many further ticks, any of sent_N_ may have acted
  double weight_ = 1;
  bool started_ = false;
};

}  // namespace filiform
