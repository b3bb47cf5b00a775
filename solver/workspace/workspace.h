// The map between the device's workspace and the world: centre, rotation and scale.
//
// The map is stored about a pivot, a point known in both frames: p_W = pivot_W + scale R_WD (p_D - pivot_D). Zoom and
// rotation make the proxy the pivot. So the proxy's p_D stays exactly the same, at any zoom and any distance from the
// origin. While the proxy is in the *static* region (the inner part of the device's box), the map does not move. In the
// *dynamic* region (the rest of the box and everything beyond), the world moves under the device, so that the proxy
// comes back into the static region. Thread rule: haptic thread only; a copy is a snapshot of the whole state.
#pragma once

#include "index/errors.h"
#include "index/geometry/grid.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace filiform {

struct WorkspaceOptions {
  Eigen::Vector3d lo_D{-0.06, -0.06, -0.06}, hi_D{0.06, 0.06, 0.06};  // m, the device's box
  double zoom_um = 300;           // um of world across Workspace::kZoomSpan_m of device
  double static_fraction = 0.75;  // size of the static region, as a fraction (0..1) of the box in each dimension
  // >= 0; speed (m/s) of the world under the device at the edge of the box and beyond. It grows linearly from 0 at the
  // border of the static region. With proxy and hand at rest, the spring's force changes by at most stiffness *
  // drift_speed * dt in a tick. 0: the workspace never moves.
  double drift_speed_m_s = 0.1;
};

class Workspace {
 public:
  static constexpr double kZoomSpan_m = 0.12;
  static constexpr double kMinZoom_um = 1e-6, kMaxZoom_um = 1e6;  // changes of the zoom are clamped to this range
  // Throws UsageError for a zoom outside of this range.
  static void requireZoom(double zoom_um);

  // Puts the device's centre at the world's origin, with parallel axes. Throws UsageError for an empty or infinite box,
  // a fraction outside 0..1, a negative speed, or a zoom outside of the range.
  explicit Workspace(const WorkspaceOptions& options);

  Eigen::Vector3d toWorld(const Eigen::Vector3d& p_D) const noexcept {
    return pivot_W_ + scale_um_m_ * (rotation_WD_ * (p_D - pivot_D_));
  }
  Eigen::Vector3d toDevice(const Eigen::Vector3d& p_W) const noexcept {
    return pivot_D_ + rotation_WD_.conjugate() * (p_W - pivot_W_) / scale_um_m_;
  }
  Eigen::Vector3d centre_D() const noexcept { return 0.5 * (options_.lo_D + options_.hi_D); }
  Eigen::Vector3d centre_W() const noexcept { return toWorld(centre_D()); }
  Eigen::Matrix3d rotationMatrix() const noexcept { return rotation_WD_.toRotationMatrix(); }  // R_WD
  double scale_um_m() const noexcept { return scale_um_m_; }  // um of world for each metre of device
  double zoom_um() const noexcept { return scale_um_m_ * kZoomSpan_m; }
  const WorkspaceOptions& options() const noexcept { return options_; }
  bool inStatic(const Eigen::Vector3d& p_D) const noexcept;

  // Moves the world so that p_W lies at p_D. Rotation and scale stay. Ends a centring. Arguments that are not finite
  // change nothing.
  void place(const Eigen::Vector3d& p_W, const Eigen::Vector3d& p_D) noexcept;
  // Changes the scale about the proxy, whose p_D stays. A zoom that is not > 0 and finite changes nothing.
  void setZoom(double zoom_um, const Eigen::Vector3d& proxy_W) noexcept;
  // Turns the world by these angles, as the user sees it, about the screen's X axis, then its Y axis (frame D,
  // right-handed), through the proxy, whose p_D stays. Angles that are not finite change nothing.
  void rotate(double about_x_rad, double about_y_rad, const Eigen::Vector3d& proxy_W) noexcept;
  // Sets the whole map, for example from a snapshot, with which the commanding thread draws. Ends a centring. A map
  // that is not finite or a zoom that is not > 0 changes nothing.
  void lay(const Vector3d& centre_W, const Eigen::Quaterniond& rotation_WD, double zoom_um) noexcept;
  // Starts a centring: the next calls of drift() bring the proxy to the centre of the device, at most at the drift
  // speed.
  void startCentring() noexcept { centring_ = true; }
  bool centring() const noexcept { return centring_; }

  // One tick: moves the world under the device, as the regions require. Returns the shift (m, frame D): the p_D of
  // every point falls by it. The shift is at most drift_speed * dt_s long and never passes the border of the static
  // region (or the centre). O(1).
  Eigen::Vector3d drift(const Eigen::Vector3d& proxy_W, double dt_s) noexcept {
    return drift(proxy_W, toDevice(proxy_W), dt_s);
  }
  // For a known p_D = toDevice(proxy_W).
  Eigen::Vector3d drift(const Eigen::Vector3d& proxy_W, const Eigen::Vector3d& p_D, double dt_s) noexcept;

 private:
  WorkspaceOptions options_;
  Eigen::Vector3d pivot_W_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d pivot_D_;
  Eigen::Quaterniond rotation_WD_ = Eigen::Quaterniond::Identity();
  double scale_um_m_;
  bool centring_ = false;
};

}  // namespace filiform
