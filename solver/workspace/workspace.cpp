#include "solver/workspace/workspace.h"

#include "device/vector_length.h"
#include "index/errors.h"

#include <algorithm>
#include <cmath>

namespace filiform {
namespace {

using Eigen::Vector3d;

double scaleOf(double zoom_um) {
  return std::clamp(zoom_um, Workspace::kMinZoom_um, Workspace::kMaxZoom_um) / Workspace::kZoomSpan_m;
}

bool isZoom(double zoom_um) { return std::isfinite(zoom_um) && zoom_um > 0; }

}  // namespace

void Workspace::requireZoom(double zoom_um) {
  if (!(zoom_um >= kMinZoom_um && zoom_um <= kMaxZoom_um))
    throw UsageError("the zoom must be a number from 1e-06 to 1000000 um");
}

Workspace::Workspace(const WorkspaceOptions& options) : options_(options) {
  if (!options.lo_D.allFinite() || !options.hi_D.allFinite() || !(options.lo_D.array() < options.hi_D.array()).all())
    throw UsageError("the device's workspace is empty or not finite; give a box with lo < hi on each axis");
  if (!(options.static_fraction >= 0 && options.static_fraction <= 1))
    throw UsageError("the static fraction of the workspace must be between 0 and 1");
  if (!(options.drift_speed_m_s >= 0 && std::isfinite(options.drift_speed_m_s)))
    throw UsageError("the drift speed of the workspace must be finite and >= 0 m/s");
  requireZoom(options.zoom_um);
  pivot_D_ = centre_D();
  scale_um_m_ = scaleOf(options.zoom_um);
}

bool Workspace::inStatic(const Vector3d& p_D) const noexcept {
  const Vector3d half = 0.5 * options_.static_fraction * (options_.hi_D - options_.lo_D);
  return ((p_D - centre_D()).cwiseAbs().array() <= half.array()).all();
}

void Workspace::place(const Vector3d& p_W, const Vector3d& p_D) noexcept {
  if (!p_W.allFinite() || !p_D.allFinite()) return;
  pivot_W_ = p_W;
  pivot_D_ = p_D;
  centring_ = false;
}

void Workspace::setZoom(double zoom_um, const Vector3d& proxy_W) noexcept {
  const Vector3d p_D = toDevice(proxy_W);
  if (!isZoom(zoom_um) || !p_D.allFinite()) return;
  pivot_W_ = proxy_W;
  pivot_D_ = p_D;
  scale_um_m_ = scaleOf(zoom_um);
}

void Workspace::rotate(double about_x_rad, double about_y_rad, const Vector3d& proxy_W) noexcept {
  const Vector3d p_D = toDevice(proxy_W);
  if (!std::isfinite(about_x_rad) || !std::isfinite(about_y_rad) || !p_D.allFinite()) return;
  pivot_W_ = proxy_W;
  pivot_D_ = p_D;
  const Eigen::Quaterniond turn_D =
      Eigen::AngleAxisd(about_y_rad, Vector3d::UnitY()) * Eigen::AngleAxisd(about_x_rad, Vector3d::UnitX());
  rotation_WD_ = (rotation_WD_ * turn_D.conjugate()).normalized();
}

void Workspace::lay(const Vector3d& centre_W, const Eigen::Quaterniond& rotation_WD, double zoom_um) noexcept {
  if (!isZoom(zoom_um) || !centre_W.allFinite() || !(rotation_WD.norm() > 0) || !rotation_WD.coeffs().allFinite())
    return;
  pivot_W_ = centre_W;
  pivot_D_ = centre_D();
  rotation_WD_ = rotation_WD.normalized();
  scale_um_m_ = scaleOf(zoom_um);
  centring_ = false;
}

Vector3d Workspace::drift(const Vector3d& proxy_W, const Vector3d& p_D, double dt_s) noexcept {
  if (!p_D.allFinite() || !(dt_s > 0)) return Vector3d::Zero();
  const double most = options_.drift_speed_m_s * dt_s;
  const Vector3d from_centre = p_D - centre_D();
  const Vector3d half = 0.5 * (options_.hi_D - options_.lo_D);

  Vector3d shift = Vector3d::Zero();
  if (centring_) {
    shift = from_centre;
  } else {
    for (int axis = 0; axis < 3; ++axis) {
      const double border = options_.static_fraction * half[axis];
      const double excess = std::abs(from_centre[axis]) - border;
      if (!(excess > 0)) continue;
      const double depth = excess < half[axis] - border ? excess / (half[axis] - border) : 1.0;
      shift[axis] = std::copysign(std::min(excess, depth * most), from_centre[axis]);
    }
  }
  const double length = lengthOf(shift);
  if (length == 0.0) {
    centring_ = false;
    return shift;
  }
  if (length > most) shift *= most / length;
  pivot_W_ = proxy_W;
  pivot_D_ = p_D - shift;
  return shift;
}

}  // namespace filiform
