// Where the eye is, which way it looks, and how the world comes to pixels. Frame V is that of the eye: x to the right,
// y up, it looks along -z; um. Pixels run from the top left corner, x right, y down. Immutable values;
// thread-compatible.
#pragma once

#include "index/query/nearest.h"
#include "index/set/levels.h"

#include <Eigen/Core>

namespace filiform {

class Workspace;

// The pyramid that is seen: its rim on the near plane, frame V, um. It need not be symmetric (stereo.h).
struct Frustum {
  double left, right, bottom, top;
  double near_um, far_um;
};

// All that is needed to draw one picture.
struct EyeView {
  Vector3d eye_W = Vector3d::Zero();
  Eigen::Matrix3d rotation_VW = Eigen::Matrix3d::Identity();
  Frustum frustum{-1, 1, -1, 1, 1, 100};

  Vector3d toView(const Vector3d& p_W) const { return rotation_VW * (p_W - eye_W); }
};

struct PictureSize {
  int width = 1280, height = 800;
  double aspect() const { return static_cast<double>(width) / height; }
};

struct Camera {
  static constexpr double kHeightAngle_rad = 0.6981317007977318;  // 40 degrees

  Vector3d eye_W = Vector3d::Zero();
  Eigen::Matrix3d rotation_VW = Eigen::Matrix3d::Identity();
  double height_angle_rad = kHeightAngle_rad;  // seen from the lower to the upper rim
  double focus_um = 100;                       // to what is looked at: where stereo converges
  double near_um = 1, far_um = 1000;

  Vector3d focus_W() const { return eye_W - focus_um * rotation_VW.row(2).transpose(); }
};

// From `eye_W` to `target_W`, with `up_W` upwards on the screen as far as that can be (any direction where it is along
// the line of sight). Throws UsageError when the two coincide or something is not finite.
Camera lookAt(const Vector3d& eye_W, const Vector3d& target_W, const Vector3d& up_W = Vector3d::UnitY());

// Looks at the middle of the box so that all of it is in the picture. At yaw and pitch 0 from the front, along -z; yaw
// takes the eye to the right, pitch upwards. An empty box is an UsageError.
Camera overview(const Vector3d& lo_W, const Vector3d& hi_W, double yaw_rad, double pitch_rad, double aspect);

// Turns the eye about what it looks at, by angles about the screen's upright and level axes; distance times `factor`.
// Angles that are not finite, or a factor that is not > 0 and finite, are an UsageError.
Camera orbit(const Camera& camera, double yaw_rad, double pitch_rad, double factor = 1);

// The person's view of the device: along the device's -z, the box's front filling `fill` of the picture's height or
// width, whichever is scarcer. What zoom and rotation do to the world under the device, they do to the picture.
Camera follow(const Workspace& workspace, double aspect, double fill = 0.8);

// The same from so far away that what is nearer looks no larger (an orthographic view, to some parts in a thousand):
// what lies at the focus keeps its size and place, a narrow angle takes the place of the wide one.
Camera parallel(const Camera& camera);

// Moves near and far so that the box lies between them, near at least 1/kDepthRatio of far, far at least the focus.
inline constexpr double kDepthRatio = 20000;
Camera fitDepth(const Camera& camera, const Vector3d& lo_W, const Vector3d& hi_W);

// The symmetric view, its angle's tangent `widening` times as large.
EyeView viewOf(const Camera& camera, double aspect, double widening = 1);

// As OpenGL has it: depth -1 at near, 1 at far. Frame V to clip space.
Eigen::Matrix4d projection(const Frustum& frustum);

// Pixels from the corner, and the depth -z in um; a point in the eye's plane or behind gives depth <= 0 and no pixel.
struct ScreenPoint {
  double x, y, depth_um;
};
ScreenPoint project(const EyeView& view, const Vector3d& p_W, const PictureSize& size);

// Pixels that an angle of one radian takes in the middle of the picture.
double pixelsPerRadian(const Frustum& frustum, const PictureSize& size);

// The line of sight through a pixel's place, with a tolerance of `tolerance_px`.
RayQuery pickRay(const EyeView& view, double x, double y, const PictureSize& size, double tolerance_px = 4);

// For the choice of tiles: the six planes of the frustum, and how large things are.
LevelView levelView(const EyeView& view, const PictureSize& size);

}  // namespace filiform
