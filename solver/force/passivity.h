// Bounds the energy that rendering gives to the hand, whatever proxy, rate, delay and hand do: an observer and a
// controller in the time domain (after Hannaford and Ryu 2002, with a second stage that makes the bound strict).
//
//   controller.apply(force, h, stored, ..., dt)   ->  limits of the force law  ->  controller.sent(force)
//
// The observer keeps E (J), the energy that the renderer holds from the hand. From one tick to the next the hand moves
// by dh while the force that was sent `delay` ticks earlier acts: E falls by f . dh. This is exact for a force that is
// held over the period. Three rules make E a budget:
//   ceiling    E is at most what the spring stores now. What a proxy that found a nearer place gave up is dissipated,
//              not saved for later.
//   allowance  below zero E recovers by power_W: what is forgotten is at most that power.
//   start      after a start, jump or change of mode E is what the spring stores, and what a spring that pulls with the
//              fading force would store: such a command brings its energy.
// Where E < 0 the controller, if on, (1) damps: f -= a v with a = min(max_damping, -E / (dt v^2)), the damping that
// takes the deficit back within a period; (2) weakens: f *= w, w at most 1 + E / energy_J, so nothing is left at
// E = -energy_J. Where the damping's cap binds, or the hand reverses faster than the delay lets damping act, the second
// rule holds alone. w falls at once and rises by recovery_1_s at most: were it to follow E both ways, the force would
// stiffen by F^2 / energy_J and vibrate by itself; so it is weaker on the way back than on the way out, and dissipates.
//
// Invariant, with the controller on and forces of at most F: at every tick
//   E >= -energy_J - (delay + 1) F s,   s the longest step of the hand in a tick,
// so over any time t without a start the hand is given at most what the spring held at its begin, plus energy_J +
// power_W t + (delay + 1) F s. It asks nothing of the hand, the proxy or the regularity of ticks; it asks that `delay`
// is the device's, that positions are true, and that the device renders what it is sent.
//
// Where it is not known which force acted while the hand moved (the hand is seen to move after samples that were the
// same; a force was taken away between two samples), each axis counts the force that gives most. E is then too low
// rather than too high, for a hand that does not turn back in between.
//
// Work that the workspace does by moving under the hand is a command, bounded apart (FORCES.md): carried() takes it
// out. Thread rule: haptic thread only; a copy is a snapshot of its whole state.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace filiform {

struct PassivityOptions {
  static constexpr int kMaxDelay = 8;

  bool on = false;              // off: only observes
  double energy_J = 1e-3;       // > 0: the deficit at which no force is left
  double power_W = 1e-4;        // >= 0: the deficit that is forgotten a second
  double recovery_1_s = 0.2;    // > 0; how fast a weakened force comes back
  double max_damping_Ns_m = 5;  // >= 0; a device's velocity noise times this is felt
  int delay_samples = 1;        // 0 .. kMaxDelay: ticks between a force commanded and its effect
};

struct PassivityEnergy {     // J, since construction
  double observed = 0;       // E now
  double least = 0;          // the lowest E was
  double injected = 0;       // by moves of the proxy at a resting hand: what they added to the spring, summed
  double injected_most = 0;  // by one such move
  double weakest = 1;        // the lowest w was
  std::uint64_t acted = 0;   // ticks at which the controller changed the force
};

class PassivityController {
 public:
  // Throws UsageError for an option out of its range or not finite.
  explicit PassivityController(const PassivityOptions& options);

  // One tick: observes the motion to h_D, and answers the force (N) that may be sent now in place of `force_N`.
  // Requires finite vectors, and what the spring stores at this probe: with the proxy now, and with the proxy where it
  // was a tick ago, both >= 0. A dt_s that is not > 0 and finite counts as no time.
  Eigen::Vector3d apply(const Eigen::Vector3d& force_N, const Eigen::Vector3d& h_D, double stored_J,
                        double stored_by_last_proxy_J, double dt_s) noexcept;
  // What was commanded in the end, once a tick.
  void sent(const Eigen::Vector3d& force_N) noexcept;
  // What the device was really sent in place of the force of the last sent(): before the next apply(). Zero in place of
  // another force also means that nobody knows for how long the forces before it acted.
  void acted(const Eigen::Vector3d& force_N) noexcept;
  // Since the last tick the world was moved under the device: every point's p_D fell by `shift_D`.
  void carried(const Eigen::Vector3d& shift_D) noexcept { carried_D_ += shift_D; }
  // A start, a jump, a change of mode.
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
  // The forces that may have acted since the hand was last seen to move, on each axis; none yet: lo > hi.
  Eigen::Vector3d lo_N_ = kNone, hi_N_ = -kNone;
  int doubtful_ = 0;  // for so many ticks all of sent_N_ may have acted
  double weight_ = 1;
  bool started_ = false;
};

}  // namespace filiform
