#include "index/contacts/closest_places.h"

#include "index/geometry/closest_point.h"

#include <cmath>

namespace filiform {
namespace {

// What both functions need of the planes through the two axes.
struct AxisProducts {
  Vector3d d, e, r;  // along the first and the second axis; from the second child to the first
  double dd, ee, de, dr, er;
  double independence;  // 0: parallel, or a segment without length

  AxisProducts(const SegmentEnds& a, const SegmentEnds& b)
      : d(a.parent_W - a.child_W),
        e(b.parent_W - b.child_W),
        r(a.child_W - b.child_W),
        dd(d.squaredNorm()),
        ee(e.squaredNorm()),
        de(d.dot(e)),
        dr(d.dot(r)),
        er(e.dot(r)),
        independence(dd * ee - de * de) {}
};

bool isInside(double t) { return t > 0 && t < 1; }

// On the cone, the place at which |p - h| - r(p) is least: its derivative along the axis is 0, or has one sign.
double closestToPoint(const SegmentEnds& cone, const Vector3d& h_W) {
  const Vector3d d = cone.parent_W - cone.child_W, x = h_W - cone.child_W;
  const double growth = cone.parent_radius_um - cone.child_radius_um, length2 = d.squaredNorm();
  if (growth * growth >= length2) return growth > 0 ? 1 : 0;
  const double foot = x.dot(d) / length2;
  const double aside = (x - foot * d).norm();
  const double t = foot + growth * aside / std::sqrt(length2 * (length2 - growth * growth));
  return t > 0 ? (t < 1 ? t : 1) : 0;
}

}  // namespace

ClosestPlaces closestOnAxes(const SegmentEnds& a, const SegmentEnds& b) {
  ClosestPlaces best{};
  double best2 = HUGE_VAL;
  const auto offer = [&](double on_a, double on_b, double squared_distance) {
    if (!(squared_distance < best2)) return;
    best.t = {on_a, on_b};
    best2 = squared_distance;
  };
  const AxisProducts p(a, b);
  for (const double end : {0.0, 1.0}) {
    const ClosestPoint on_b = closestPoint(b.child_W, b.parent_W, p.e, p.ee, a.at(end));
    offer(end, on_b.t, on_b.squared_distance);
  }
  for (const double end : {0.0, 1.0}) {
    const ClosestPoint on_a = closestPoint(a.child_W, a.parent_W, p.d, p.dd, b.at(end));
    offer(on_a.t, end, on_a.squared_distance);
  }
  if (p.independence > 0) {
    const double on_a = (p.de * p.er - p.dr * p.ee) / p.independence;
    if (isInside(on_a)) {
      const double on_b = (p.de * on_a + p.er) / p.ee;
      if (isInside(on_b)) offer(on_a, on_b, (a.at(on_a) - b.at(on_b)).squaredNorm());
    }
  }
  best.distance_um = std::sqrt(best2);
  return best;
}

// The distance is a convex function of both places. So its least value lies where its gradient is 0, or on the border.
ClosestPlaces closestOnSurfaces(const SegmentEnds& a, const SegmentEnds& b) {
  ClosestPlaces best{{0, 0}, HUGE_VAL};
  const auto offer = [&](double on_a, double on_b) {
    const double distance_um = (a.at(on_a) - b.at(on_b)).norm() - a.radiusAt_um(on_a) - b.radiusAt_um(on_b);
    if (distance_um < best.distance_um) best = {{on_a, on_b}, distance_um};
  };
  for (const double end : {0.0, 1.0}) {
    offer(end, 0);
    offer(end, 1);
    offer(end, closestToPoint(b, a.at(end)));
  }
  for (const double end : {0.0, 1.0}) offer(closestToPoint(a, b.at(end)), end);
  const AxisProducts p(a, b);
  if (!(p.independence > 0)) return best;
  // Between the closest places lies w = |w| (m + n): m in the plane of both axes with m.d = growth of a and
  // m.e = -growth of b, n across the plane.
  const auto solve = [&](double along_d, double along_e) {
    return std::array<double, 2>{(along_d * p.ee - along_e * p.de) / p.independence,
                                 (along_e * p.dd - along_d * p.de) / p.independence};
  };
  const double grows_a = a.parent_radius_um - a.child_radius_um, grows_b = b.parent_radius_um - b.child_radius_um;
  const std::array<double, 2> m = solve(grows_a, -grows_b), r = solve(p.dr, p.er);
  const double m2 = m[0] * grows_a - m[1] * grows_b;
  if (!(m2 < 1)) return best;
  const double w = (p.r - r[0] * p.d - r[1] * p.e).norm() / std::sqrt(1 - m2);
  const double on_a = w * m[0] - r[0], on_b = r[1] - w * m[1];
  if (isInside(on_a) && isInside(on_b)) offer(on_a, on_b);
  return best;
}

}  // namespace filiform
