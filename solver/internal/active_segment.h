// What every solver does first: is the probe one to follow, and where is the segment that the proxy is on? Thread rule:
// functions without state, noexcept, without allocation, lock or system call.
#pragma once

#include "solver/graph_view.h"
#include "solver/proxy_solver.h"

namespace filiform::internal {

// Beyond this the squares of distances overflow: as good as infinite.
inline constexpr double kFarthestProbe_um = 1e150;

// False for NaN too.
inline bool usableProbe(const Vector3d& h_W) noexcept { return (h_W.array().abs() <= kFarthestProbe_um).all(); }

inline void clear(SolverStep& step) noexcept {
  step.visited = 0;
  step.capped = false;
  step.frontiers = 0;
  step.touched.count = step.absent.count = 0;
  step.touched.overflow = step.absent.overflow = false;
}

// The place's segment in its tile; nothing if the tile does not store it, or is absent, which is reported. `hint` is
// where the segment was last, and is set. O(1) where the hint holds, else O(log segments of a tile).
inline GraphView::SegmentRef activeSegment(const GraphView& graph, const ProxyPlace& place, std::uint32_t& hint,
                                           SolverStep& step) noexcept {
  const Tile* tile = graph.tiles().find(place.tile);
  if (tile == nullptr) {
    ++step.frontiers;
    step.absent.add(place.tile);
    return {};
  }
  step.touched.add(place.tile);
  if (hint < tile->segment_count() && tile->segmentId(hint) == place.segment) return {tile, hint};
  const GraphView::SegmentRef ref = graph.segment(place.tile, place.segment);
  if (ref) hint = ref.segment;
  return ref;
}

}  // namespace filiform::internal
