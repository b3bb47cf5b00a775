// SpringModel: the local model of the spring between hand and proxy, for devices that render it at their own rate, and
// for clients of a session. While the proxy is on a segment it follows the hand along the segment, so the stiffness is
// zero along it; at a node the spring holds in all directions. Thread rule: haptic thread only; a copy is a snapshot.
// Haptic-safe.
#pragma once

#include "device/haptic_device.h"

#include <Eigen/Core>

namespace filiform {

// Farther than a hand moves in the 20 ms that a model lives. Within it the force is exactly that of a spring.
inline constexpr double kModelRadius_m = 0.02;

class SpringModel {
 public:
  // No spring acts.
  void reset() noexcept { part_ = 0; }
  // The model of a force (N) that a spring of stiffness_N_m computed at the hand h_D; pull_D (m) goes from the hand to
  // the point to which the spring pulls. The limits of the force law may have shortened the force: the stiffness is
  // less by the same part. If the spring is too short to show its part, the last part counts. `along_D`: unit vector
  // along which the proxy slides, or zero. The radius is kModelRadius_m.
  LocalModel about(const Eigen::Vector3d& h_D, const Eigen::Vector3d& pull_D, const Eigen::Vector3d& force_N,
                   double stiffness_N_m, const Eigen::Vector3d& along_D) noexcept;

 private:
  double part_ = 0;  // of the stiffness that acts now, 0 .. 1
};

}  // namespace filiform
