// A probe for devices that report rates instead of a position (capabilities().rate_control). The probe moves ahead of
// the proxy at the commanded speed, up to the length of a leash, and returns to the proxy when the hand rests.
//
// So the cap of a 6-axis mouse, held to one side, pulls the proxy along its neurite at that speed. When the user
// releases the cap, the proxy stays where it is. Turns about x and y rotate the world about the proxy, turns about z
// zoom. Thread rule: haptic thread only; a copy is a snapshot of the whole state.
#pragma once

#include "index/errors.h"

#include <Eigen/Core>

namespace filiform {

struct RateControlOptions {
  // The greatest distance from proxy to probe (m of device). It limits the pull if the neurite leads elsewhere.
  double leash_m = 0.02;
  // A turn of 1 rad clockwise, as the user sees it, divides the zoom (the world across the device) by e to this power.
  double zoom_per_rad = 1;
};

class RateControl {
 public:
  // Throws UsageError for a leash that is not > 0 and finite, or a gain that is not finite.
  explicit RateControl(const RateControlOptions& options = {});

  // Returns the probe (frame D, m), with the proxy at p_D. Rates that are not finite, and a time that is not > 0 and
  // finite, count as rest.
  Eigen::Vector3d probe(const Eigen::Vector3d& p_D, const Eigen::Vector3d& v_D, double dt_s) noexcept;
  // Reports that the proxy has moved to p_D.
  void moveProxy(const Eigen::Vector3d& p_D) noexcept;
  // The distance of the probe from the proxy, as part of the leash: 0 while the proxy follows, 1 where it cannot.
  double strain() const noexcept;
  // Puts the probe at the proxy.
  void reset() noexcept { offset_D_.setZero(); }

  // The factor of the zoom in a tick at this rate about z (rad/s); within e^-1..e^1.
  double zoomFactor(double about_z_rad_s, double dt_s) const noexcept;

 private:
  RateControlOptions options_;
  Eigen::Vector3d offset_D_ = Eigen::Vector3d::Zero();  // of the probe from the proxy
  Eigen::Vector3d probe_D_ = Eigen::Vector3d::Zero();
};

}  // namespace filiform
