// The one function that decides which point of a segment is nearest. Every distance that *decides* something, in search
// and in the solver, is this one, in double, of exact world positions, child to parent: so all parts agree to the last
// bit, whatever the tiling. Float and SIMD may prune, never decide.
#pragma once

#include "index/grid.h"

namespace filiform {

struct ClosestPoint {
  double t;                 // 0 at the child, 1 at the parent; exactly 0 or 1 at the ends
  Vector3d p_W;             // the end itself, bit for bit, when t is 0 or 1
  double squared_distance;  // um^2, |p - h|^2
};

// O(1), no failure: a segment of equal ends answers its child (t = 0). Requires finite arguments. Always inlined: half
// of a tick's time goes into it, and most of that would be the answer's way through memory.
// With d_W = parent - child, which is exact as both ends lie on the grid, and its squaredNorm(), where they are known.
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

}  // namespace filiform
