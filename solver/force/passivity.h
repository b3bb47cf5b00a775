// Bounds the energy that the spring between hand and proxy gives to the hand, for any motion of both and any tick rate:
// an observer and a controller in the time domain (after Hannaford and Ryu 2002, with a second stage that makes the
// bound strict). Without PassivityOptions::on it only observes.
//
//   controller.apply(force, h, stored, ..., dt)   ->  limits of the force law  ->  controller.sent(force)
//
// The observer keeps E (J): the energy that the hand has given, minus the energy that it has received. From one tick to
// the next, the hand moves by dh while the force f that was sent `delay` ticks earlier acts: E falls by f . dh. This is
// exact for a force that is constant during the period dt. Three rules make E a budget:
//   ceiling    E is at most the energy in the spring now. Energy that is lost when the proxy finds a nearer place is
//              dissipated, not saved for later.
//   allowance  Below zero, E rises by power_W dt in each tick: a deficit is forgotten at this power.
//   start      After a start, jump or change of mode, E is the energy in the spring, plus the energy of a spring that
//              pulls with the force that is fading out: the command itself pays for this energy.
// If E < 0 and the controller is on, it does two things.
// 1. It damps: f -= a v, with v = dh / dt and a = min(max_damping, -E / (dt v^2)): the damping that removes the deficit
//    within a period.
// 2. It weakens: f *= w, with w at most 1 + E / energy_J, so no force is left at E = -energy_J. This rule keeps the
//    bound where rule 1 cannot: if the damping reaches its cap, or if the hand reverses faster than the delay lets
//    damping act. The factor w falls at once and rises by at most recovery_1_s dt in each tick. If w followed E in both
//    directions, the hand would feel a spring that is stiffer by F^2 / energy_J, and could start to oscillate. With
//    slow recovery the force is weaker on the way back than on the way out, and dissipates energy.
//
// Invariant, with the controller on, forces of at most F (N), and steps of the hand of at most d (m) in a tick: always
//   E >= -energy_J - (delay + 1) F d.
// So over any time t without a start, the hand receives at most the energy in the spring at the begin of that time,
// plus energy_J + power_W t + (delay + 1) F d. This makes no assumption about the hand, the proxy or the regularity of
// ticks. It assumes that `delay` is the device's delay, that reported positions are correct, and that the device
// renders the force that it is sent.
//
// Sometimes it is unknown which force acted while the hand moved: if the hand moves after several equal states, or if
// a force was taken away between two states. Then each axis counts that possible force which gives the hand most
// energy. So E is too low rather than too high, unless the hand turns back between two reported positions.
//
// When the workspace moves, the world moves under the hand. This work on the hand is bounded separately (FORCES.md);
// carried() excludes it from E. Thread rule: haptic thread only; a copy is a snapshot of the whole state.
#pragma once

#include "index/errors.h"

#include <array>
#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace filiform {

struct PassivityOptions {
  static constexpr int kMaxDelay = 8;

  bool on = false;              // false: only observe
  double energy_J = 1e-3;       // > 0; the deficit at which no force is left
  double power_W = 1e-4;        // >= 0; deficit (J) that is forgotten each second
  double recovery_1_s = 0.2;    // > 0; rate at which a weakened force recovers
  double max_damping_Ns_m = 5;  // >= 0; the damping multiplies the noise of the velocity, and the hand feels it
  int delay_samples = 1;        // 0 .. kMaxDelay; `delay` above. 0: a force acts from the tick in which it is sent
};

struct PassivityEnergy {     // J; since construction, whatever restart() did
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

  // One tick: observes the hand's motion to h_D (m). Returns the force (N, frame D) to send instead of `force_N`.
  // `stored_J` and `stored_by_last_proxy_J` are the energy in the spring at this probe, with the proxy now and with the
  // proxy of the last tick, both >= 0. Requires finite vectors. With a dt_s that is not > 0 and finite, nothing is
  // forgotten, recovered or damped.
  Eigen::Vector3d apply(const Eigen::Vector3d& force_N, const Eigen::Vector3d& h_D, double stored_J,
                        double stored_by_last_proxy_J, double dt_s) noexcept;
  // Reports the force (N) that was commanded after all limits. Call once after each apply().
  void sent(const Eigen::Vector3d& force_N) noexcept;
  // Reports the force that the device was really sent instead of the force of the last sent(). Call before the next
  // apply(). If it is zero instead of another force, the device may have dropped its force at any moment; so each force
  // of the last `delay` + 1 ticks counts as possible.
  void acted(const Eigen::Vector3d& force_N) noexcept;
  // Reports that the workspace has moved since the last tick: the p_D of every point of the world changed by -shift_D
  // (m). Several calls add up.
  void carried(const Eigen::Vector3d& shift_D) noexcept { carried_D_ += shift_D; }
  // Call at a start, jump or change of mode: the next apply() sets E by the rule "start".
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
