#include "viewer/scene/camera.h"

#include "index/errors.h"
#include "solver/workspace/workspace.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace filiform {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Matrix4d;

Camera lookAt(const Vector3d& eye_W, const Vector3d& target_W, const Vector3d& up_W) {
  const Vector3d back = eye_W - target_W;
  const double distance = back.norm();
  if (!(distance > 0) || !std::isfinite(distance) || !up_W.allFinite())
    throw UsageError("camera: eye and target must be two different points with finite coordinates");
  const Vector3d z = back / distance;
  Vector3d x = up_W.cross(z);
  if (x.norm() <= 1e-6 * up_W.norm()) x = z.unitOrthogonal();
  x.normalize();
  Camera camera;
  camera.eye_W = eye_W;
  camera.rotation_VW.row(0) = x;
  camera.rotation_VW.row(1) = z.cross(x);
  camera.rotation_VW.row(2) = z;
  camera.focus_um = distance;
  camera.near_um = distance / 100;
  camera.far_um = distance * 10;
  return camera;
}

Camera overview(const Vector3d& lo_W, const Vector3d& hi_W, double yaw_rad, double pitch_rad, double aspect) {
  if (!(lo_W.array() <= hi_W.array()).all() || !lo_W.allFinite() || !hi_W.allFinite())
    throw UsageError("camera: nothing to look at: the box is empty");
  const Vector3d middle_W = (lo_W + hi_W) / 2;
  Camera camera = lookAt(middle_W + Vector3d::UnitZ(), middle_W);
  camera = orbit(camera, yaw_rad, pitch_rad);
  // Each corner needs some distance; the largest is enough for all.
  const double tan_up = std::tan(camera.height_angle_rad / 2), tan_across = tan_up * aspect;
  constexpr double kMargin = 1.04;
  double distance = 1e-3;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d p_W((corner & 1) != 0 ? hi_W.x() : lo_W.x(), (corner & 2) != 0 ? hi_W.y() : lo_W.y(),
                       (corner & 4) != 0 ? hi_W.z() : lo_W.z());
    const Vector3d p = camera.rotation_VW * (p_W - middle_W);
    distance = std::max(
        {distance, p.z() + kMargin * std::abs(p.x()) / tan_across, p.z() + kMargin * std::abs(p.y()) / tan_up});
  }
  camera.eye_W = middle_W + distance * camera.rotation_VW.row(2).transpose();
  camera.focus_um = distance;
  return fitDepth(camera, lo_W, hi_W);
}

Camera orbit(const Camera& camera, double yaw_rad, double pitch_rad, double factor) {
  if (!std::isfinite(yaw_rad) || !std::isfinite(pitch_rad) || !(factor > 0) || !std::isfinite(factor))
    throw UsageError("camera: angles must be finite, and a factor > 0");
  Camera turned = camera;
  // The world turns the other way under an eye that rests.
  const Matrix3d turn = (AngleAxisd(pitch_rad, Vector3d::UnitX()) * AngleAxisd(-yaw_rad, Vector3d::UnitY())).matrix();
  turned.rotation_VW = turn * camera.rotation_VW;
  turned.focus_um = camera.focus_um * factor;
  turned.eye_W = camera.focus_W() + turned.focus_um * turned.rotation_VW.row(2).transpose();
  return turned;
}

Camera workspaceCamera(const Workspace& workspace, double aspect, double fill) {
  const WorkspaceOptions& options = workspace.options();
  const Vector3d half_um = 0.5 * workspace.scale_um_m() * (options.hi_D - options.lo_D);
  Camera camera;
  camera.rotation_VW = workspace.rotationMatrix().transpose();
  const double tan_up = std::tan(camera.height_angle_rad / 2);
  const double to_front = std::max(half_um.y(), half_um.x() / aspect) / (fill * tan_up);
  camera.focus_um = to_front + half_um.z();
  camera.eye_W = workspace.centre_W() + camera.focus_um * camera.rotation_VW.row(2).transpose();
  camera.near_um = to_front / 50;
  camera.far_um = camera.focus_um + 3 * half_um.maxCoeff();
  return camera;
}

Camera parallel(const Camera& camera) {
  constexpr double kAngle_rad = 0.002;
  Camera far = camera;
  far.height_angle_rad = kAngle_rad;
  far.focus_um = camera.focus_um * std::tan(camera.height_angle_rad / 2) / std::tan(kAngle_rad / 2);
  const double away_um = far.focus_um - camera.focus_um;
  far.eye_W = camera.eye_W + away_um * camera.rotation_VW.row(2).transpose();
  far.near_um = camera.near_um + away_um;
  far.far_um = camera.far_um + away_um;
  return far;
}

Camera fitDepth(const Camera& camera, const Vector3d& lo_W, const Vector3d& hi_W) {
  double nearest = INFINITY, farthest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d p_W((corner & 1) != 0 ? hi_W.x() : lo_W.x(), (corner & 2) != 0 ? hi_W.y() : lo_W.y(),
                       (corner & 4) != 0 ? hi_W.z() : lo_W.z());
    const double depth = -(camera.rotation_VW.row(2) * (p_W - camera.eye_W)).value();
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  Camera fitted = camera;
  constexpr double kMargin = 1.01;
  fitted.far_um = std::max(farthest * kMargin, camera.focus_um * kMargin);
  fitted.near_um = std::clamp(nearest / kMargin, fitted.far_um / kDepthRatio, camera.focus_um / kMargin);
  return fitted;
}

EyeView viewOf(const Camera& camera, double aspect, double widening) {
  const double up = camera.near_um * std::tan(camera.height_angle_rad / 2) * widening, across = up * aspect;
  return {camera.eye_W, camera.rotation_VW, {-across, across, -up, up, camera.near_um, camera.far_um}};
}

Matrix4d projection(const Frustum& f) {
  Matrix4d m = Matrix4d::Zero();
  m(0, 0) = 2 * f.near_um / (f.right - f.left);
  m(0, 2) = (f.right + f.left) / (f.right - f.left);
  m(1, 1) = 2 * f.near_um / (f.top - f.bottom);
  m(1, 2) = (f.top + f.bottom) / (f.top - f.bottom);
  m(2, 2) = -(f.far_um + f.near_um) / (f.far_um - f.near_um);
  m(2, 3) = -2 * f.far_um * f.near_um / (f.far_um - f.near_um);
  m(3, 2) = -1;
  return m;
}

ScreenPoint project(const EyeView& view, const Vector3d& p_W, const PictureSize& size) {
  const Vector3d p = view.toView(p_W);
  const double depth = -p.z();
  if (!(depth > 0)) return {NAN, NAN, depth};
  const Frustum& f = view.frustum;
  const double x = p.x() * f.near_um / depth, y = p.y() * f.near_um / depth;  // on the near plane
  return {(x - f.left) / (f.right - f.left) * size.width, (f.top - y) / (f.top - f.bottom) * size.height, depth};
}

double pixelsPerRadian(const Frustum& f, const PictureSize& size) {
  return size.height * f.near_um / (f.top - f.bottom);
}

RayQuery pickRay(const EyeView& view, double x, double y, const PictureSize& size, double tolerance_px) {
  const Frustum& f = view.frustum;
  const Vector3d on_near(f.left + x / size.width * (f.right - f.left), f.top - y / size.height * (f.top - f.bottom),
                         -f.near_um);
  RayQuery ray;
  ray.origin_W = view.eye_W;
  ray.direction = (view.rotation_VW.transpose() * on_near).normalized();
  ray.slope = tolerance_px / pixelsPerRadian(f, size);
  ray.length_um = f.far_um * on_near.norm() / f.near_um;
  return ray;
}

LevelView levelView(const EyeView& view, const PictureSize& size, double nearest_um) {
  const Frustum& f = view.frustum;
  LevelView levels;
  levels.eye_W = view.eye_W;
  levels.pixels_per_rad = pixelsPerRadian(f, size);
  levels.nearest_um = std::max(nearest_um, f.near_um);
  const auto add = [&](const Vector3d& inwards_V, double least) {
    const Vector3d n = view.rotation_VW.transpose() * inwards_V;
    levels.planes.push_back({n, n.dot(view.eye_W) + least});
  };
  // Each side goes through the eye and one line of the rim.
  add(Vector3d(f.near_um, 0, f.left).normalized(), 0);
  add(Vector3d(-f.near_um, 0, -f.right).normalized(), 0);
  add(Vector3d(0, f.near_um, f.bottom).normalized(), 0);
  add(Vector3d(0, -f.near_um, -f.top).normalized(), 0);
  add(-Vector3d::UnitZ(), levels.nearest_um);
  add(Vector3d::UnitZ(), -f.far_um);
  return levels;
}

}  // namespace filiform
