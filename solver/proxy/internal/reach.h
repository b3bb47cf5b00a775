// The rule by which a depth-first search leaves a segment. It is the only difference between the basic solver
// (descent.h) and the two variants of the force-based solver (force_based.h).
#pragma once

#include "index/geometry/closest_point.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace filiform::internal {

enum class Escape : std::uint8_t { none, text, listing };
struct Reach {
  Escape escape = Escape::none;
  double gain = 0, r_min_um = 0, r_max_um = 0;

  // The squared distance beyond which a branch ends. `sub_goal2`: squared distance of the branch's sub-goal; `best2`:
  // of the best point so far.
  double bound2(double sub_goal2, double best2) const noexcept { return escape == Escape::listing ? best2 : sub_goal2; }
};

// Calls go_on(at_parent) for each end from which the search continues. The end to be visited first is passed last. `q`:
// closest point of the segment, and new sub-goal; `bound2`: see Reach::bound2().
template <typename GoOn>
[[gnu::always_inline]] inline void visitEnds(const Reach& reach, const Vector3d& child_W, const Vector3d& parent_W,
                                             const ClosestPoint& q, double bound2, const GoOn& go_on) noexcept {
  if (reach.escape == Escape::none) {
    if (q.t == 0.0) go_on(false);
    if (q.t == 1.0) go_on(true);
    return;
  }
  const bool listing = reach.escape == Escape::listing;
  if (listing ? q.squared_distance > bound2 : q.squared_distance >= bound2) return;
  if (!listing && q.t == 0.0) return go_on(false);
  if (!listing && q.t == 1.0) return go_on(true);
  const double r_um = std::min(reach.r_max_um, reach.gain * std::sqrt(q.squared_distance) + reach.r_min_um);
  // Tests |end - q| < r (listing: <= r) without a square root, unless rounding could decide.
  const double r2 = r_um * r_um, surely2 = r2 * (1 - 1e-12), never2 = r2 * (1 + 1e-12);
  const auto within = [&](const Vector3d& end_W) {
    const double d2 = (end_W - q.p_W).squaredNorm();
    if (d2 < surely2 || d2 > never2) return d2 < surely2;
    return listing ? std::sqrt(d2) <= r_um : std::sqrt(d2) < r_um;
  };
  if (within(parent_W)) go_on(true);
  if (within(child_W)) go_on(false);
}

}  // namespace filiform::internal
