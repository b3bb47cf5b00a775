// What the pointer's place on the picture means for the hand. Pure functions.
#pragma once

#include "solver/workspace/workspace.h"
#include "viewer/scene/camera.h"

namespace filiform {

// Where the hand is wanted (frame D, m) so that it is seen at the pixel, as far from the eye as `at_depth_W` and
// `closer_m` nearer; within the device's box. `at_depth_W` itself where it is behind the eye.
Vector3d pointedAt_D(const EyeView& view, double x, double y, const PictureSize& size, const Workspace& workspace,
                     const Vector3d& at_depth_W, double closer_m);

// By what a drag of so many pixels turns the world (rad, about the screen's X and Y): the height of the picture is half
// a turn.
struct Turn {
  double about_x_rad, about_y_rad;
};
Turn turnOf(double dx_px, double dy_px, const PictureSize& size);

// By what a notch of the wheel divides what is seen across the workspace.
inline constexpr double kZoomNotch = 1.2;

}  // namespace filiform
