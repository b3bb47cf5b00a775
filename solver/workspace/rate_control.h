// A probe for devices that have no position, only rates (capabilities().rate_control): it runs ahead of the proxy as
// fast as the hand asks, on a leash, and comes back to the proxy when the hand rests.
//
// So the cap of a 6-axis mouse, held to one side, pulls the proxy along its thread at that speed, and letting go leaves
// it where it is. Turns about x and y rotate the world about the proxy, turns about z zoom. Thread rule: haptic thread
// only; a copy is a snapshot of its whole state.
#pragma once

#include <Eigen/Core>

namespace filiform {

struct RateControlOptions {
  // How far the probe may be from the proxy (m of device): how hard one can pull where the thread does not follow.
  double leash_m = 0.02;
  // A turn of 1 rad clockwise, as the person sees it, divides the zoom (the world across the device) by e to this.
  double zoom_per_rad = 1;
};

class RateControl {
 public:
  // Throws UsageError for a leash that is not > 0 and finite, or a gain that is not finite.
  explicit RateControl(const RateControlOptions& options = {});

  // Where the probe is now (frame D, m), with the proxy at p_D. Rates that are not finite, and a time that is not > 0
  // and finite, count as rest.
  Eigen::Vector3d probe(const Eigen::Vector3d& p_D, const Eigen::Vector3d& v_D, double dt_s) noexcept;
  // The proxy has followed that probe to p_D.
  void followed(const Eigen::Vector3d& p_D) noexcept;
  // The probe is at the proxy, wherever that is.
  void reset() noexcept { offset_D_.setZero(); }

  // By what the zoom changes at this rate about z (rad/s); within e^-1..e^1 a tick.
  double zoomFactor(double about_z_rad_s, double dt_s) const noexcept;

 private:
  RateControlOptions options_;
  Eigen::Vector3d offset_D_ = Eigen::Vector3d::Zero();  // of the probe from the proxy
  Eigen::Vector3d probe_D_ = Eigen::Vector3d::Zero();
};

}  // namespace filiform
