#include "viewer/scene/glyph.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace filiform {

namespace {

class Shape {
 public:
  void cone(const Vector3d& a, double a_radius, const Vector3d& b, double b_radius, Rgba colour) {
    DrawnSegment s{};
    for (int axis = 0; axis < 3; ++axis) {
      s.a_um[axis] = static_cast<float>(a[axis]);
      s.b_um[axis] = static_cast<float>(b[axis]);
    }
    s.a_radius_um = static_cast<float>(a_radius);
    s.b_radius_um = static_cast<float>(b_radius);
    s.paint = paintOf(colour);
    batch.segments.push_back(s);
    const double most = std::max(a_radius, b_radius);
    batch.lo_W = batch.lo_W.cwiseMin(a.cwiseMin(b) - Vector3d::Constant(most));
    batch.hi_W = batch.hi_W.cwiseMax(a.cwiseMax(b) + Vector3d::Constant(most));
    batch.largest_radius_um = std::max(batch.largest_radius_um, static_cast<float>(most));
  }
  NeuriteBatch batch;
};

}  // namespace

NeuriteBatch glyphBatch(const Junction& junction, double length_um, double line_um, const GlyphPalette& palette) {
  Shape shape;
  shape.batch.origin_W = shape.batch.lo_W = shape.batch.hi_W = junction.p_W;
  shape.batch.lo_W.setZero();
  shape.batch.hi_W.setZero();
  for (const Branch& branch : junction.branches) {
    double drawn_um = 0;
    for (std::size_t i = 1; i < branch.points_W.size(); ++i)
      drawn_um += (branch.points_W[i] - branch.points_W[i - 1]).norm();
    if (!(drawn_um > 0)) continue;
    const double stretch = length_um / drawn_um, radius = (branch.own ? 1.8 : 1.0) * line_um / 2;
    const Rgba colour = branch.own ? palette.own : palette.other;
    // The line ends where the head begins.
    const double head_um = std::min(0.3 * length_um, (branch.own ? 5.0 : 6.0) * line_um);
    double left = length_um - head_um;
    Vector3d at = Vector3d::Zero(), way = Vector3d::UnitX();
    for (std::size_t i = 1; i < branch.points_W.size() && left > 0; ++i) {
      const Vector3d step = stretch * (branch.points_W[i] - branch.points_W[i - 1]);
      const double length = step.norm();
      if (!(length > 0)) continue;
      way = step / length;
      const Vector3d to = at + std::min(length, left) * way;
      shape.cone(at, radius, to, radius, colour);
      at = to;
      left -= length;
    }
    if (branch.own) {
      shape.cone(at, 0.4 * head_um, at + head_um * way, 0.02 * head_um, colour);
    } else {
      constexpr int kSides = 16;
      const Vector3d u = way.unitOrthogonal(), v = way.cross(u), middle = at + 0.5 * head_um * way;
      // Two crossed rings: from any direction, one of them looks open.
      for (const Vector3d& across : {u, v})
        for (int i = 0; i < kSides; ++i) {
          const auto on_ring = [&](int k) -> Vector3d {
            const double angle = 2 * std::numbers::pi * k / kSides;
            return middle + 0.5 * head_um * (std::cos(angle) * way + std::sin(angle) * across);
          };
          shape.cone(on_ring(i), 0.7 * radius, on_ring(i + 1), 0.7 * radius, colour);
        }
    }
  }
  shape.batch.lo_W += junction.p_W;
  shape.batch.hi_W += junction.p_W;
  return std::move(shape.batch);
}

}  // namespace filiform
