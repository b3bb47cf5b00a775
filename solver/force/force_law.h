// What the hand feels: a spring from the probe to the proxy, made safe. FORCES.md states the law, its order and its
// bounds.
//
//   f = K (p - h) - B v  ->  finite?  ->  passivity controller  ->  force gate: clamp, slew limit, fade, ramp
//
// Everything is in frame D (metres, newtons, seconds), so the force does not depend on the zoom. What weakens the force
// passes at once, but for a command (restart()), where the force fades; what strengthens it is limited. Thread rule:
// haptic thread only; a copy is a snapshot of its whole state.
#pragma once

#include "device/haptic_device.h"
#include "solver/force/force_gate.h"
#include "solver/force/passivity.h"

#include <cstdint>

#include <Eigen/Core>

namespace filiform {

struct ForceLawOptions {
  double stiffness_N_m = 200;  // K > 0; up to twice the hand's own stiffness is safe, 50 suits a light touch
  double damping_Ns_m = 0;     // B >= 0; 0: none. Adds the noise of the device's velocity to the force
  double max_force_N = 8;      // > 0; longer forces are shortened and keep their direction
  // > 0; how fast the force may grow, beyond what the hand's own motion stretches the spring by. A fall is never
  // delayed.
  double max_slew_N_s = 100;
  // >= 0; the hand's motion counts up to this speed. At 0 the slew limit would lag behind the hand on its way out and
  // not on its way back: a spring that gives more than it took, and vibrates well below the stability bound.
  double free_speed_m_s = 1;
  double ramp_s = 0.5;  // >= 0; after a start, jump or change of mode the force grows from zero over this time
  // >= 0; at a jump or change of mode the force falls to zero over this time first, a force above
  // fade_s max_slew_N_s at max_slew_N_s. 0: at once.
  double fade_s = 0.05;
  PassivityOptions passivity;  // observes always; acts where it is on
};

struct ForceLawEvents {  // ticks, since construction
  std::uint64_t not_finite = 0, clamped = 0, slewed = 0;
};

class ForceLaw {
 public:
  // Throws UsageError for an option out of its range or not finite.
  explicit ForceLaw(const ForceLawOptions& options);

  // The force to command now (N, frame D). Always finite, at most max_force_N long, and longer than the last one by at
  // most (max_slew_N_s + max_force_N / ramp_s) dt_s + K min(|dh|, free_speed_m_s dt_s), dh the hand's step since the
  // last tick; without the ramp's part once that is over. It points along the
  // spring's force, but for what the passivity controller damps. Zero at once, and counted, if an argument or the
  // spring's force is not finite. A dt_s that is not > 0 and finite counts as 0. O(1).
  Eigen::Vector3d apply(const Eigen::Vector3d& p_D, const Eigen::Vector3d& h_D, const Eigen::Vector3d& v_D,
                        double dt_s) noexcept;
  // As apply(), without a spring (free mode, no proxy): zero, or what is left of a fade. h_D must be finite.
  Eigen::Vector3d applyNothing(const Eigen::Vector3d& h_D, double dt_s) noexcept;
  // No force, at once: the device is not ready.
  Eigen::Vector3d release() noexcept;
  // A jump or change of mode: the force falls to zero over fade_s, then grows over ramp_s.
  void restart() noexcept;
  // A device that has become ready: the next force is zero and grows from there over ramp_s.
  void restartFromZero() noexcept;
  // What the device was really sent in place of the last answer (DeviceState::sent_N). Before the next apply().
  void acted(const Eigen::Vector3d& sent_N) noexcept { passivity_.acted(sent_N); }
  // The workspace has moved the world under the device: every point's p_D fell by `shift_D` (m).
  void carried(const Eigen::Vector3d& shift_D) noexcept;

  // What the spring stores (J) at that extension, its force limited to max_force_N. At most 1e12.
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

// The largest stiffness K (N/m) of a spring that is rendered passively with a damper B, a period T and a delay of d
// samples, against a viscous damping b of device and hand: K = (b - |B|) / (T/2 + d T). 0 where b <= |B|. Requires T >
// 0.
//
// Sources: Colgate and Schenkel, "Passivity of a class of sampled-data systems: application to haptic interfaces",
// American Control Conference 1994: without delay the rendering is passive if and only if b > K T/2 + |B|. Their
// criterion with a delay of d samples gives b > K (T/2 + d T) + |B| as a sufficient condition, exact for d = 0 or B =
// 0. Gil, Sanchez, Hulin, Preusche and Hirzinger, "Stability boundary for haptic rendering: influence of damping and
// delay", Journal of Computing and Information Science in Engineering 9(1), 2009: against a hand that is linear,
// stability ends at K = (b + B) / (T/2 + d T) for small B. Virtual damping so helps stability and costs passivity; the
// bound here is the smaller one.
double stiffnessBound(double damping_Ns_m, double period_s, double delay_samples,
                      double virtual_damping_Ns_m = 0) noexcept;

// The stiffness (N/m) that a device gets unless told otherwise: 200 N/m, or less where 0.8 of the bound with the
// device's own damping alone, or the device's own limit, is less. Where the damping is unknown (0) only energy is
// bounded, not stability promised.
double defaultStiffness(const DeviceCapabilities& device, double period_s) noexcept;

}  // namespace filiform
