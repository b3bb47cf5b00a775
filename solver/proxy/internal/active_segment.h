// The start of every tick of a solver: checks the probe, and finds the segment on which the proxy is. Thread rule:
// haptic thread only; noexcept, without allocation, lock or system call.
#pragma once

#include "index/geometry/closest_point.h"
#include "solver/graph/graph_view.h"
#include "solver/graph/internal/working_graph.h"
#include "solver/proxy/proxy_solver.h"

namespace filiform::internal {

// False if the squared distance may overflow in later sums, or is NaN.
inline bool usableDistance(double squared_um2) noexcept { return squared_um2 <= 1e300; }

// The decoded segment of the proxy. It is kept until the proxy leaves the segment.
struct ActiveSegment {
  struct End {
    NodeId id{};
    Vector3d p_W = Vector3d::Zero();
    std::uint32_t node = 0;                     // index in `tile`
    std::uint32_t local = WorkingGraph::kNone;  // last known index in the working graph; see isKept()
  };
  const Tile* tile = nullptr;  // nullptr: none
  TileId home = kNoTile;       // id of `tile`
  SegmentId id{UINT32_MAX, UINT32_MAX};
  std::uint32_t segment = 0;  // index in `tile`
  End child, parent;
  Vector3d d_W = Vector3d::Zero();  // from child to parent
  double length2 = 0;               // squared length of d_W

  [[gnu::always_inline]] ClosestPoint closestTo(const Vector3d& h_W) const noexcept {
    return closestPoint(child.p_W, parent.p_W, d_W, length2, h_W);
  }
  // Loads the segment of the place. Returns false if the tile is absent, which is reported in `step`, or does not store
  // the segment. O(1) if the segment is loaded already or its index in the tile is known, else O(log segments of a
  // tile).
  [[gnu::always_inline]] bool moveTo(const GraphView& graph, const ProxyPlace& place, SolverStep& step) noexcept {
    if (tile != nullptr && id == place.segment && home == place.tile && graph.tiles().find(home) == tile) {
      step.touched.add(home);
      return true;
    }
    return find(graph, place, step);
  }
  // Takes over an edge of an open node.
  void become(const WorkingGraph& graph, std::uint32_t n, const WorkingGraph::Edge& edge) noexcept {
    const WorkingGraph::Node& node = graph.node(n);
    tile = node.tile;
    home = node.home;
    id = {node.id.cell, edge.rank};
    segment = edge.segment;
    End &near = edge.from_child ? child : parent, &far = edge.from_child ? parent : child;
    near = {node.id, node.p_W, node.node, n};
    far = {edge.farId(node.id), edge.far_W, edge.far, edge.to};
    d_W = parent.p_W - child.p_W;
    length2 = edge.length2;
  }
  // Like GraphView::placeOn(), without a search.
  ProxyPlace place(const GraphView& graph, double t, const Vector3d& p_W) const noexcept {
    ProxyPlace place;
    place.segment = id;
    place.t = t;
    place.p_W = p_W;
    place.tile = home;
    place.at_node = t == 0.0 || t == 1.0;
    if (place.at_node) {
      const End& end = t == 0.0 ? child : parent;
      place.node = end.id;
      const TileId home_of_end = graph.homeId(*tile, end.node);
      if (home_of_end != kNoTile) place.tile = home_of_end;
    }
    return place;
  }
  WorkingGraph::Seen seen(const End& end) const noexcept {
    const bool at_home = tile->isHome(end.node);
    return {end.id, end.p_W, at_home ? home : kNoTile, at_home ? end.node : WorkingGraph::kNone};
  }
  std::uint32_t meet(WorkingGraph& graph, End& end) const noexcept {
    if (!graph.isKept(end.local, end.id)) end.local = graph.meet(seen(end));
    return end.local;
  }
  // Returns the local index of the node that the proxy rests at. Requires place.at_node.
  std::uint32_t meetNode(WorkingGraph& graph, const ProxyPlace& place) noexcept {
    End& end = place.t == 0.0 ? child : parent;
    if (!graph.isKept(end.local, place.node)) end.local = graph.meet({place.node, place.p_W});
    return end.local;
  }
  // Calls WorkingGraph::prepare() for the ends of the place's segment.
  void prepare(WorkingGraph& graph, const GraphView& view, const ProxyPlace& place, const Vector3d& ahead_W,
               std::uint32_t most) noexcept;

 private:
  bool find(const GraphView& graph, const ProxyPlace& place, SolverStep& step) noexcept;
};

}  // namespace filiform::internal
