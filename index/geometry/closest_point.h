// closestPoint: decides which point of a segment is nearest. Search and solver take every decision by these distances:
// in double, of exact world positions, from child to parent. So all parts agree to the last bit, whatever the tiling.
// Float and SIMD code may prune but never decide. Thread rule: pure functions.
#pragma once

#include "index/geometry/grid.h"

#include <algorithm>

namespace filiform {

struct ClosestPoint {
  double t;                 // 0 at the child, 1 at the parent; exactly 0 or 1 at the ends
  Vector3d p_W;             // exactly the end if t is 0 or 1
  double squared_distance;  // um^2, |p - h|^2
};

// The nearest point to h_W on a segment. If both ends are equal, t = 0. Requires finite arguments. O(1). Always
// inlined: half of a tick's time is spent here, and returning through memory would take most of it.
//
// This overload takes d_W = parent_W - child_W (exact, since both ends lie on the grid) and length2 = |d_W|^2.
[[gnu::always_inline]] inline ClosestPoint closestPoint(const Vector3d& child_W, const Vector3d& parent_W,
                                                        const Vector3d& d_W, double length2,
                                                        const Vector3d& h_W) noexcept {
  const double s = (h_W - child_W).dot(d_W);
  if (!(s > 0.0) || length2 == 0.0) return {0.0, child_W, (child_W - h_W).squaredNorm()};
  if (s >= length2) return {1.0, parent_W, (parent_W - h_W).squaredNorm()};
  const double t = s / length2;
  const Vector3d p_W = child_W + t * d_W;
  return {t, p_W, (p_W - h_W).squaredNorm()};
}
[[gnu::always_inline]] inline ClosestPoint closestPoint(const Vector3d& child_W, const Vector3d& parent_W,
                                                        const Vector3d& h_W) noexcept {
  const Vector3d d_W = parent_W - child_W;
  return closestPoint(child_W, parent_W, d_W, d_W.squaredNorm(), h_W);
}

struct ClosestApproach {
  double along;             // distance from the ray's origin in units of |direction|, >= 0
  double t;                 // position on the segment: 0 at the child, 1 at the parent
  Vector3d p_W;             // the point on the segment
  double squared_distance;  // um^2, between the two points
};

// The closest approach of a segment and the ray origin + along * direction, along >= 0. If several places are equally
// close, as on parallels: the first along the ray, up to rounding. Requires a unit direction and finite arguments.
// O(1). Source: Ericson, Real-Time Collision Detection, 5.1.9, with one end open.
inline ClosestApproach closestApproach(const Vector3d& child_W, const Vector3d& parent_W, const Vector3d& origin_W,
                                       const Vector3d& direction) noexcept {
  const Vector3d d = parent_W - child_W, r = child_W - origin_W;
  const double a = d.squaredNorm(), b = d.dot(direction), c = d.dot(r), f = direction.dot(r);
  // Minimise |r + t d - along direction|^2 over t in [0, 1], where along = max(0, f + t b).
  const auto at = [&](double t) {
    const Vector3d p_W = t == 0.0 ? child_W : t == 1.0 ? parent_W : Vector3d(child_W + t * d);
    const double along = std::max(0.0, direction.dot(p_W - origin_W));
    return ClosestApproach{along, t, p_W, (origin_W + along * direction - p_W).squaredNorm()};
  };
  ClosestApproach best = at(0.0);
  const auto offer = [&](double t) {
    const ClosestApproach other = at(t);
    if (other.squared_distance < best.squared_distance ||
        (other.squared_distance == best.squared_distance && other.along < best.along))
      best = other;
  };
  offer(1.0);
  const double e = a - b * b;  // > 0 unless parallel
  if (e > 0.0) {
    const double t = (b * f - c) / e;
    if (t > 0.0 && t < 1.0) offer(t);
  }
  if (a > 0.0) {  // the segment's nearest point to the origin, where the ray begins
    const double t = -c / a;
    if (t > 0.0 && t < 1.0) offer(t);
  }
  return best;
}

}  // namespace filiform
