// Computes the force that the hand feels: a spring from the probe to the proxy, with limits. FORCES.md states the law,
// the order of its steps and its bounds.
//
//   f = K (p - h) - B v  ->  finite?  ->  passivity controller  ->  force gate: clamp, slew limit, fade, ramp
//
// All quantities are in frame D (metres, newtons, seconds), so the force does not depend on the zoom. A decrease passes
// at once, except at a command (restart()), where the force fades; an increase is limited. Thread rule: haptic thread
// only; a copy is a snapshot of the whole state.
#pragma once

#include "device/haptic_device.h"
#include "solver/force/force_gate.h"
#include "solver/force/passivity.h"

#include <cstdint>

#include <Eigen/Core>

namespace filiform {

// The spring between proxy and hand, and the limits of its force.
struct ForceLawOptions {
  double stiffness_N_m = 200;  // K > 0; safe up to twice the hand's own stiffness; 50 suits a light touch
  double damping_Ns_m = 0;     // B >= 0; adds the noise of the device's velocity to the force
  double max_force_N = 8;      // > 0; longer forces are shortened and keep their direction
  // > 0; limits increases of the force that the hand's own motion does not cause. A fall is never delayed.
  double max_slew_N_s = 100;
  // >= 0; the hand's motion is exempt from the slew limit up to this speed. At 0 the spring would lag on the way out
  // but not on the way back. It would return more energy than it took, and vibrate well below the stability bound.
  double free_speed_m_s = 1;
  double ramp_s = 0.5;  // >= 0; after a start, jump or change of mode the force grows from zero over this time
  // >= 0; at a jump or change of mode the force first falls to zero over this time, but not faster than max_slew_N_s.
  // 0: at once.
  double fade_s = 0.05;
  PassivityOptions passivity;  // observes always, acts if passivity.on
};

struct ForceLawEvents {  // numbers of ticks since construction
  std::uint64_t not_finite = 0, clamped = 0, slewed = 0;
};

class ForceLaw {
 public:
  // Throws UsageError for an option that is out of range or not finite.
  explicit ForceLaw(const ForceLawOptions& options);

  // Returns the force to command now (N, frame D). It is always finite and at most max_force_N long. It exceeds the
  // last force by at most (max_slew_N_s + max_force_N / ramp_s) dt_s + K min(|dh|, free_speed_m_s dt_s), where dh is
  // the hand's step since the last tick; after the ramp, its term is absent. Its direction is that of the spring's
  // force, apart from the passivity controller's damping. If an argument or the spring's force is not finite, the force
  // is zero at once, and the tick is counted. A dt_s that is not > 0 and finite counts as 0. O(1).
  Eigen::Vector3d apply(const Eigen::Vector3d& p_D, const Eigen::Vector3d& h_D, const Eigen::Vector3d& v_D,
                        double dt_s) noexcept;
  // Like apply(), without a spring (free mode, no proxy): zero, or the rest of a fade. Requires a finite h_D.
  Eigen::Vector3d applyNothing(const Eigen::Vector3d& h_D, double dt_s) noexcept;
  // Returns zero at once: the device is not ready.
  Eigen::Vector3d release() noexcept;
  // For a jump or change of mode: the force falls to zero over fade_s, then grows over ramp_s.
  void restart() noexcept;
  // For a device that has become ready: the next force is zero and grows over ramp_s.
  void restartFromZero() noexcept;
  // Reports the force that was really sent instead of the last result (DeviceState::sent_N). Call before the next
  // apply().
  void acted(const Eigen::Vector3d& sent_N) noexcept { passivity_.acted(sent_N); }
  // Reports that the workspace has moved the world under the device: the p_D of every point fell by `shift_D` (m).
  void carried(const Eigen::Vector3d& shift_D) noexcept;

  // The old force fades: the last result is not that of the spring.
  bool fading() const noexcept { return gate_.fading(); }

  // The energy (J) in the spring at this extension, with its force limited to max_force_N. At most 1e12.
  double storedEnergy(double extension_m) const noexcept;

  const ForceLawOptions& options() const { return options_; }
  ForceLawEvents events() const { return {not_finite_, gate_.events().clamped, gate_.events().slewed}; }
  const PassivityEnergy& energy() const { return passivity_.energy(); }

 private:
  Eigen::Vector3d send(const Eigen::Vector3d& allowed_N, double dt_s, double free_N) noexcept;
  double storedInFade(double dt_s) const noexcept;

  ForceLawOptions options_;
  std::uint64_t not_finite_ = 0;
  PassivityController passivity_;
  ForceGate gate_;
  Eigen::Vector3d last_p_D_ = Eigen::Vector3d::Zero(), last_h_D_ = Eigen::Vector3d::Zero();
  bool started_ = false;
};

// The largest stiffness K (N/m) at which the rendering is passive: a spring with a damper B, a period T and a delay of
// d periods, against a viscous damping b of device and hand. K = (b - |B|) / (T/2 + d T); 0 if b <= |B|. Requires T >
// 0.
//
// Sources: Colgate and Schenkel, "Passivity of a class of sampled-data systems: application to haptic interfaces",
// American Control Conference 1994: without delay, the rendering is passive if and only if b > K T/2 + |B|. With a
// delay of d periods, their criterion gives b > K (T/2 + d T) + |B| as a sufficient condition, exact for d = 0 or B =
// 0. Gil, Sanchez, Hulin, Preusche and Hirzinger, "Stability boundary for haptic rendering: influence of damping and
// delay", Journal of Computing and Information Science in Engineering 9(1), 2009: against a linear hand, stability ends
// at K = (b + B) / (T/2 + d T) for small B. So virtual damping helps stability and costs passivity; the bound here is
// the smaller one.
double stiffnessBound(double damping_Ns_m, double period_s, double delay_samples,
                      double virtual_damping_Ns_m = 0) noexcept;

// The largest stiffness (N/m) to render on a device: the least of 0.8 of the bound with the device's own damping alone,
// if the damping is known, and the device's own limit, if that is known. Infinite if neither is known.
double mostStiffness(const DeviceCapabilities& device, double period_s) noexcept;

// The default stiffness (N/m) of a device: the least of 200 N/m and mostStiffness(). If the damping is unknown (0),
// only energy is bounded; stability is not promised.
double defaultStiffness(const DeviceCapabilities& device, double period_s) noexcept;

}  // namespace filiform
