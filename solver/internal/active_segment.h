// What every solver does first: is the probe one to follow, and where is the segment that the proxy is on? Thread rule:
// functions without state, noexcept, without allocation, lock or system call.
#pragma once

#include "index/closest_point.h"
#include "solver/graph_view.h"
#include "solver/internal/star_cache.h"
#include "solver/proxy_solver.h"

namespace filiform::internal {

// Beyond this, squared, distances overflow: as good as infinite. False for NaN too.
inline bool usableDistance(double squared_um2) noexcept { return squared_um2 <= 1e300; }

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

// The segment that the proxy is on, decoded, and kept for as long as it stays there.
struct ActiveSegment {
  const Tile* tile = nullptr;  // nullptr: none
  TileId home = kNoTile;       // id of `tile`
  SegmentId id{UINT32_MAX, UINT32_MAX};
  std::uint32_t segment = 0, child = 0, parent = 0;  // in `tile`
  NodeId child_id{}, parent_id{};
  Vector3d child_W = Vector3d::Zero(), parent_W = Vector3d::Zero(), d_W = Vector3d::Zero();
  double length2 = 0;  // of d_W, child to parent, squared

  [[gnu::always_inline]] ClosestPoint closestTo(const Vector3d& h_W) const noexcept {
    return closestPoint(child_W, parent_W, d_W, length2, h_W);
  }
  bool isOf(const ProxyPlace& place) const noexcept { return id == place.segment && home == place.tile; }
  // Makes it that of the place; false as activeSegment(). O(1) where it is already, or the hint holds.
  [[gnu::always_inline]] bool follow(const GraphView& graph, const ProxyPlace& place, std::uint32_t& hint,
                                     SolverStep& step) noexcept {
    if (isOf(place) && tile != nullptr && graph.tiles().find(home) == tile) {
      hint = segment;
      step.touched.add(home);
      return true;
    }
    return find(graph, place, hint, step);
  }
  // Makes it a branch of a node that is decoded already.
  void become(const StarCache::Star& star, const StarCache::Ray& ray) noexcept {
    tile = star.tile;
    home = star.home;
    id = {star.id.cell, ray.rank};
    segment = ray.segment;
    const NodeId far_id{star.id.cell, ray.far_rank};
    child = ray.from_child ? star.node : ray.far;
    parent = ray.from_child ? ray.far : star.node;
    child_id = ray.from_child ? star.id : far_id;
    parent_id = ray.from_child ? far_id : star.id;
    child_W = ray.from_child ? star.p_W : ray.far_W;
    parent_W = ray.from_child ? ray.far_W : star.p_W;
    d_W = parent_W - child_W;
    length2 = d_W.squaredNorm();
  }

 private:
  bool find(const GraphView& graph, const ProxyPlace& place, std::uint32_t& hint, SolverStep& step) noexcept {
    const GraphView::SegmentRef ref = activeSegment(graph, place, hint, step);
    if (!ref) return false;
    tile = ref.tile;
    home = place.tile;
    id = place.segment;
    segment = ref.segment;
    const Tile::Link link = tile->link(segment);
    child = link.child;
    parent = link.parent;
    child_id = link.child_id;
    parent_id = link.parent_id;
    child_W = tile->position_W(child);
    parent_W = tile->position_W(parent);
    d_W = parent_W - child_W;
    length2 = d_W.squaredNorm();
    return true;
  }
};

}  // namespace filiform::internal
