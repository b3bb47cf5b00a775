// Translates the mouse pointer into hand positions and rotations. Pure functions.
#pragma once

#include "solver/workspace/workspace.h"
#include "viewer/scene/camera.h"

namespace filiform {

// The hand position (frame D, m) that appears at pixel (x, y), at the depth of `at_depth_W` but `closer_m` nearer to
// the user, and clamped to the device's box. If `at_depth_W` is behind the eye, its own position is used.
Vector3d pointedAt_D(const EyeView& view, double x, double y, const PictureSize& size, const Workspace& workspace,
                     const Vector3d& at_depth_W, double closer_m);

// The rotation of the world for a drag (rad, about the screen's X and Y axes): the picture's height is half a turn.
struct Turn {
  double about_x_rad, about_y_rad;
};
Turn turnOf(double dx_px, double dy_px, const PictureSize& size);

// One notch of the wheel divides or multiplies the zoom (um across the workspace) by this factor.
inline constexpr double kZoomNotch = 1.2;

}  // namespace filiform
