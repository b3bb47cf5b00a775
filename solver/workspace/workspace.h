// Where the device's workspace lies in the world: centre, rotation and scale.
//
// The map is kept about an anchor, a point known in both frames: p_W = anchor_W + scale R_WD (p_D - anchor_D). Zoom and
// rotation make the proxy the anchor, so that its p_D is unchanged exactly, however far from the origin and at any
// zoom. While the proxy is in the *static* region (the inner part of the device's box) the map rests; in the *dynamic*
// region (the rest of the box, and all beyond) the world is moved under the device, so that the proxy comes back.
// Thread rule: haptic thread only; a copy is a snapshot of its whole state.
#pragma once

#include "index/geometry/grid.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace filiform {

struct WorkspaceOptions {
  Eigen::Vector3d lo_D{-0.06, -0.06, -0.06}, hi_D{0.06, 0.06, 0.06};  // m, the device's box
  double zoom_um = 300;           // world um across Workspace::kZoomSpan_m of device
  double static_fraction = 0.75;  // of the box in each dimension, 0..1; 1: the dynamic region begins at the box
  // The world's speed under the device at the rim of the box and beyond (m/s); it grows evenly from 0 at the static
  // region. At a fixed proxy and hand the spring's force changes by at most stiffness * drift_speed * dt a tick. 0: the
  // workspace never moves.
  double drift_speed_m_s = 0.1;
};

class Workspace {
 public:
  static constexpr double kZoomSpan_m = 0.12;
  static constexpr double kMinZoom_um = 1e-6, kMaxZoom_um = 1e6;  // zooms are clamped to this range

  // The device's centre at the world's origin, axes parallel. Throws UsageError for an empty or infinite box, a
  // fraction out of 0..1, a negative speed, or a zoom that is not > 0 and finite.
  explicit Workspace(const WorkspaceOptions& options);

  Eigen::Vector3d toWorld(const Eigen::Vector3d& p_D) const noexcept {
    return anchor_W_ + scale_um_m_ * (rotation_WD_ * (p_D - anchor_D_));
  }
  Eigen::Vector3d toDevice(const Eigen::Vector3d& p_W) const noexcept {
    return anchor_D_ + rotation_WD_.conjugate() * (p_W - anchor_W_) / scale_um_m_;
  }
  Eigen::Vector3d centre_D() const noexcept { return 0.5 * (options_.lo_D + options_.hi_D); }
  Eigen::Vector3d centre_W() const noexcept { return toWorld(centre_D()); }
  Eigen::Matrix3d rotationMatrix() const noexcept { return rotation_WD_.toRotationMatrix(); }  // R_WD
  double scale_um_m() const noexcept { return scale_um_m_; }  // um of world a metre of device
  double zoom_um() const noexcept { return scale_um_m_ * kZoomSpan_m; }
  const WorkspaceOptions& options() const noexcept { return options_; }
  bool inStatic(const Eigen::Vector3d& p_D) const noexcept;

  // From now on p_W lies at p_D; rotation and scale stay. Ends a centring. Arguments that are not finite change
  // nothing.
  void place(const Eigen::Vector3d& p_W, const Eigen::Vector3d& p_D) noexcept;
  // Changes the scale about the proxy; its p_D stays. A zoom that is not > 0 and finite changes nothing.
  void setZoom(double zoom_um, const Eigen::Vector3d& proxy_W) noexcept;
  // Turns the world as it is seen by these angles about the screen's X, then Y (frame D, right-handed) through the
  // proxy, whose p_D stays. Angles that are not finite change nothing.
  void rotate(double about_x_rad, double about_y_rad, const Eigen::Vector3d& proxy_W) noexcept;
  // The whole map, as a snapshot has it: what the commanding thread draws with. Ends a centring. A map that is not
  // finite or a zoom that is not > 0 changes nothing.
  void lay(const Vector3d& centre_W, const Eigen::Quaterniond& rotation_WD, double zoom_um) noexcept;
  // Brings the proxy to the centre of the device, at no more than the drift speed, over the next calls of follow().
  void startCentring() noexcept { centring_ = true; }
  bool centring() const noexcept { return centring_; }

  // One tick: moves the world under the device as the regions ask. Returns how far, in frame D (m): every point's p_D
  // falls by that; at most drift_speed * dt_s long, and never past the border of the static region (or the centre).
  // O(1).
  Eigen::Vector3d follow(const Eigen::Vector3d& proxy_W, double dt_s) noexcept {
    return follow(proxy_W, toDevice(proxy_W), dt_s);
  }
  // The same where toDevice(proxy_W) is known.
  Eigen::Vector3d follow(const Eigen::Vector3d& proxy_W, const Eigen::Vector3d& p_D, double dt_s) noexcept;

 private:
  WorkspaceOptions options_;
  Eigen::Vector3d anchor_W_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d anchor_D_;
  Eigen::Quaterniond rotation_WD_ = Eigen::Quaterniond::Identity();
  double scale_um_m_;
  bool centring_ = false;
};

}  // namespace filiform
