#include "viewer/scene/pointer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filiform {

Vector3d pointedAt_D(const EyeView& view, double x, double y, const PictureSize& size, const Workspace& workspace,
                     const Vector3d& at_depth_W, double closer_m) {
  const double depth_um = -view.toView(at_depth_W).z();
  Vector3d p_W = at_depth_W;
  if (depth_um > 0) {
    const RayQuery ray = pickRay(view, x, y, size);
    const double along = depth_um / -(view.rotation_VW.row(2) * ray.direction).value();
    p_W = view.eye_W + along * ray.direction;
  }
  Vector3d p_D = workspace.toDevice(p_W);
  p_D.z() += closer_m;
  const WorkspaceOptions& box = workspace.options();
  return p_D.cwiseMax(box.lo_D).cwiseMin(box.hi_D);
}

Turn turnOf(double dx_px, double dy_px, const PictureSize& size) {
  const double rad_px = std::numbers::pi / std::max(size.height, 1);
  return {dy_px * rad_px, dx_px * rad_px};
}

}  // namespace filiform
