// Cameras: where the eye is, where it looks, and how world positions become pixels. Frame V is the eye's: x to the
// right, y up, it looks along -z; um. Pixels count from the top left corner, x right, y down. Immutable values;
// thread-compatible.
#pragma once

#include "index/levels/levels.h"
#include "index/query/nearest.h"

#include <Eigen/Core>

namespace filiform {

class Workspace;

// The visible pyramid, by its rim on the near plane; frame V, um. It may be asymmetric (stereo.h).
struct Frustum {
  double left, right, bottom, top;
  double near_um, far_um;
};

// The view of one eye.
struct EyeView {
  Vector3d eye_W = Vector3d::Zero();
  Eigen::Matrix3d rotation_VW = Eigen::Matrix3d::Identity();
  Frustum frustum{-1, 1, -1, 1, 1, 100};

  Vector3d toView(const Vector3d& p_W) const { return rotation_VW * (p_W - eye_W); }
};

// The size of a picture, pixels.
struct PictureSize {
  int width = 1280, height = 800;
  double aspect() const { return static_cast<double>(width) / height; }
};

struct Camera {
  static constexpr double kHeightAngle_rad = 0.6981317007977318;  // 40 degrees

  Vector3d eye_W = Vector3d::Zero();
  Eigen::Matrix3d rotation_VW = Eigen::Matrix3d::Identity();
  double height_angle_rad = kHeightAngle_rad;  // between the lower and the upper rim
  double focus_um = 100;                       // distance of the target; stereo converges there
  double near_um = 1, far_um = 1000;

  Vector3d focus_W() const { return eye_W - focus_um * rotation_VW.row(2).transpose(); }
};

// Looks from `eye_W` to `target_W`, with `up_W` as nearly upwards on the screen as possible (arbitrary if `up_W` lies
// along the line of sight). Throws UsageError if eye and target coincide or a coordinate is not finite.
Camera lookAt(const Vector3d& eye_W, const Vector3d& target_W, const Vector3d& up_W = Vector3d::UnitY());

// Shows the whole box, with its middle in the middle of the picture. Yaw and pitch 0 look from the front, along -z; yaw
// moves the eye to the right, pitch upwards. Throws UsageError for an empty box.
Camera overview(const Vector3d& lo_W, const Vector3d& hi_W, double yaw_rad, double pitch_rad, double aspect);

// Turns the eye about its target, by angles about the screen's upright and level axes, and multiplies its distance by
// `factor`. Throws UsageError for angles that are not finite, or a factor that is not finite and > 0.
Camera orbit(const Camera& camera, double yaw_rad, double pitch_rad, double factor = 1);

// The user's view of the workspace: along the device's -z. The front of the device's box fills the part `fill` of the
// picture's height or width, whichever is smaller. Zoom and rotation of the workspace thus change the picture too.
Camera workspaceCamera(const Workspace& workspace, double aspect, double fill = 0.8);

// An orthographic view, to a few parts in a thousand: the camera seen through a narrow angle from far away. Points at
// the focus keep their size and place.
Camera parallel(const Camera& camera);

// Moves the near and far planes so that the box lies between them. Near stays at least far / kDepthRatio; far stays
// beyond the focus.
inline constexpr double kDepthRatio = 20000;
Camera fitDepth(const Camera& camera, const Vector3d& lo_W, const Vector3d& hi_W);

// The symmetric view, with `widening` times the tangent of the camera's angle.
EyeView viewOf(const Camera& camera, double aspect, double widening = 1);

// OpenGL's projection from frame V to clip space: depth -1 at near, 1 at far.
Eigen::Matrix4d projection(const Frustum& frustum);

// Pixels from the top left corner, and the depth -z in um. At depth <= 0, x and y are NaN.
struct ScreenPoint {
  double x, y, depth_um;
};
ScreenPoint project(const EyeView& view, const Vector3d& p_W, const PictureSize& size);

// Pixels that one radian covers in the middle of the picture.
double pixelsPerRadian(const Frustum& frustum, const PictureSize& size);

// The line of sight through the pixel position (x, y), with a tolerance of `tolerance_px`.
RayQuery pickRay(const EyeView& view, double x, double y, const PictureSize& size, double tolerance_px = 4);

// For the choice of tiles: the six planes of the frustum, and the pixels per radian. Nothing nearer than `nearest_um`
// is seen.
LevelView levelView(const EyeView& view, const PictureSize& size, double nearest_um = 0);

}  // namespace filiform
