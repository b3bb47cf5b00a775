// A sweep of BoundedSearch that is small enough to end within its tick, as nearly all are: the same search in the same
// order, without anything that outlives it.
//
// Nothing is marked but the nodes entered, in a short list: all nodes that a search reaches are of one cell, so a
// sample's rank stands for the node; and a segment has been tested exactly if it is the first one, or if one of its
// ends has been entered and has come to it in its list, which is in the order of identity. What is too large, or meets
// an absent tile, is given up: BoundedSearch then does it its own way, from the start. Thread rule: haptic thread only;
// noexcept, without allocation, lock or system call.
#pragma once

#include "index/closest_point.h"
#include "solver/graph_view.h"
#include "solver/internal/active_segment.h"
#include "solver/internal/star_cache.h"
#include "solver/proxy_solver.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace filiform::internal {

// From which ends of a segment to go on: basic descent (descent.h), or the force-based escape over one local maximum in
// either reading (force_based.h).
enum class Escape : std::uint8_t { none, text, listing };
struct Reach {
  Escape escape = Escape::none;
  double gain = 0, r_min_um = 0, r_max_um = 0;

  // Squared distance beyond which a branch ends. `sub_goal2`: of the branch's sub-goal; `best2`: of the best point yet.
  double bound2(double sub_goal2, double best2) const noexcept { return escape == Escape::listing ? best2 : sub_goal2; }
};

struct BestPoint {
  const Tile* tile = nullptr;  // nullptr: the old place
  std::uint32_t segment = 0;
  double t = 0;
  Vector3d p_W = Vector3d::Zero();
  double squared_distance = 0;

  void offer(const Tile& its_tile, std::uint32_t its_segment, const ClosestPoint& q) noexcept {
    if (!(q.squared_distance < squared_distance)) return;
    tile = &its_tile;
    segment = its_segment;
    t = q.t;
    p_W = q.p_W;
    squared_distance = q.squared_distance;
  }
};

// Calls go_on(at_parent) for each end to go on from, the one to be visited first last; q is its sub-goal.
// `bound2` as from Reach::bound2.
template <typename GoOn>
[[gnu::always_inline]] inline void follow(const Reach& reach, const Vector3d& child_W, const Vector3d& parent_W,
                                          const ClosestPoint& q, double bound2, const GoOn& go_on) noexcept {
  if (reach.escape == Escape::none) {
    if (q.t == 0.0) go_on(false);
    if (q.t == 1.0) go_on(true);
    return;
  }
  if (q.squared_distance > bound2) return;
  const bool listing = reach.escape == Escape::listing;
  if (!listing && q.t == 0.0) return go_on(false);
  if (!listing && q.t == 1.0) return go_on(true);
  const double r_um = std::min(reach.r_max_um, reach.gain * std::sqrt(q.squared_distance) + reach.r_min_um);
  // |end - q| < r (the listing: <= r), without the root but where rounding might decide.
  const double r2 = r_um * r_um, surely2 = r2 * (1 - 1e-12), never2 = r2 * (1 + 1e-12);
  const auto within = [&](const Vector3d& end_W) {
    const double d2 = (end_W - q.p_W).squaredNorm();
    if (d2 < surely2 || d2 > never2) return d2 < surely2;
    return listing ? std::sqrt(d2) <= r_um : std::sqrt(d2) < r_um;
  };
  if (within(parent_W)) go_on(true);
  if (within(child_W)) go_on(false);
}

class QuickSweep {
 public:
  static constexpr std::uint32_t kMostTests = 64;
  static constexpr std::uint32_t kMostLooks = 4 * kMostTests;  // at incident segments

  // From the interior of a segment, or from a node that `tile` stores. False: given up,
  // `step` and `best` are to be forgotten.
  bool fromSegment(const GraphView& graph, StarCache& stars, const Reach& reach, const ActiveSegment& active,
                   const Vector3d& h_W, std::uint32_t most_tests, SolverStep& step, BestPoint& best) noexcept;
  bool fromNode(const GraphView& graph, StarCache& stars, const Reach& reach, NodeId id, const Tile& tile,
                std::uint32_t node, const Vector3d& h_W, std::uint32_t most_tests, SolverStep& step,
                BestPoint& best) noexcept;

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  struct Entry {
    NodeId id;
    const Tile* tile;     // any that stores the node
    std::uint32_t node;   // in `tile`
    std::uint32_t via;    // rank of the segment by which it was met; kNone: none
    std::uint32_t entry;  // its number among the entered nodes; kNone: pending
    std::uint32_t next;
    double sub_goal2;
  };
  struct Sweep;

  std::array<std::uint32_t, kMostTests + 2> samples_;  // of the nodes entered
  std::array<std::int64_t, kMostTests + 2> passed_;    // rank of the last incident segment that each has come to
  std::array<Entry, kMostTests + 2> stack_;
  std::uint32_t entered_ = 0, depth_ = 0;
};

}  // namespace filiform::internal
