#include "viewer/scene/overlay.h"

namespace filiform {

namespace {

void put(const Vector3d& p, float* to) {
  for (int axis = 0; axis < 3; ++axis) to[axis] = static_cast<float>(p[axis]);
}

}  // namespace

NeuriteBatch workspaceBatch(const Workspace& workspace, double line_um) {
  NeuriteBatch batch;
  batch.origin_W = workspace.centre_W();
  batch.lo_W = batch.hi_W = batch.origin_W;
  const WorkspaceOptions& options = workspace.options();
  const Vector3d half_D = 0.5 * (options.hi_D - options.lo_D);
  const auto radius_um = static_cast<float>(line_um / 2);
  for (const bool is_static : {false, true}) {
    const double part = is_static ? options.static_fraction : 1;
    const auto corner_W = [&](int corner) -> Vector3d {
      const Vector3d side((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
      return workspace.toWorld(workspace.centre_D() + part * half_D.cwiseProduct(side));
    };
    for (int corner = 0; corner < 8; ++corner)
      for (const int axis : {1, 2, 4}) {
        if ((corner & axis) != 0) continue;
        const Vector3d a_W = corner_W(corner), b_W = corner_W(corner | axis);
        DrawnSegment edge{};
        put(a_W - batch.origin_W, edge.a_um);
        put(b_W - batch.origin_W, edge.b_um);
        edge.a_radius_um = edge.b_radius_um = radius_um;
        edge.paint = paintOf(is_static ? kStaticColour : kDynamicColour);
        batch.segments.push_back(edge);
        batch.lo_W = batch.lo_W.cwiseMin(a_W).cwiseMin(b_W);
        batch.hi_W = batch.hi_W.cwiseMax(a_W).cwiseMax(b_W);
      }
  }
  batch.largest_radius_um = radius_um;
  return batch;
}

NeuriteBatch stylusBatch(const Stylus& stylus, double length_um) {
  NeuriteBatch batch;
  batch.origin_W = stylus.tip_W;
  const Vector3d end = stylus.rotation_WS * Vector3d(0, 0, length_um), middle = 0.6 * end;
  const Vector3d bar = middle + stylus.rotation_WS * Vector3d(0, 0.15 * length_um, 0);
  const auto thin_um = static_cast<float>(0.01 * length_um), thick_um = static_cast<float>(0.05 * length_um);
  DrawnSegment shaft{};
  put(end, shaft.b_um);
  shaft.a_radius_um = thin_um;
  shaft.b_radius_um = thick_um;
  shaft.paint = paintOf(kStylusColour);
  DrawnSegment button{};
  put(middle, button.a_um);
  put(bar, button.b_um);
  button.a_radius_um = button.b_radius_um = thick_um;
  button.paint = paintOf(kStylusColour);
  batch.segments = {shaft, button};
  batch.largest_radius_um = thick_um;
  batch.lo_W = stylus.tip_W + end.cwiseMin(bar).cwiseMin(middle).cwiseMin(Vector3d::Zero());
  batch.hi_W = stylus.tip_W + end.cwiseMax(bar).cwiseMax(middle).cwiseMax(Vector3d::Zero());
  return batch;
}

NeuriteBatch ballsBatch(std::span<const Vector3d> places_W, double radius_um, const Rgba& colour) {
  NeuriteBatch batch;
  batch.origin_W = batch.lo_W = batch.hi_W = places_W.front();
  batch.largest_radius_um = static_cast<float>(radius_um);
  for (const Vector3d& place_W : places_W) {
    DrawnSegment ball{};
    put(place_W - batch.origin_W, ball.a_um);
    put(place_W - batch.origin_W, ball.b_um);
    ball.a_radius_um = ball.b_radius_um = batch.largest_radius_um;
    ball.paint = paintOf(colour);
    batch.segments.push_back(ball);
    batch.lo_W = batch.lo_W.cwiseMin(place_W);
    batch.hi_W = batch.hi_W.cwiseMax(place_W);
  }
  batch.lo_W -= Vector3d::Constant(radius_um);
  batch.hi_W += Vector3d::Constant(radius_um);
  return batch;
}

NeuriteBatch proxyBatch(const Vector3d& p_W, double radius_um, const Rgba& colour) {
  return ballsBatch({&p_W, 1}, radius_um, colour);
}

}  // namespace filiform
