// The fork that the proxy approaches: which branches meet there, and where they lead (the paper, 4).
// Thread rule: pure functions; call them on the thread that owns the tile table.
#pragma once

#include "index/set/soma_finder.h"
#include "solver/graph/graph_view.h"

#include <optional>
#include <vector>

namespace filiform {

struct Branch {
  std::vector<Vector3d> points_W;           // from the junction outwards, at most the asked length; two or more
  SegmentId first{UINT32_MAX, UINT32_MAX};  // its segment at the junction
  bool own = false;                         // the proxy is on it
};

struct Junction {  // a node where other than two branches meet: a fork, a crossing, an end
  NodeId node{UINT32_MAX, UINT32_MAX};
  Vector3d p_W = Vector3d::Zero();
  double distance_um = 0;        // from the proxy, along the thread
  std::vector<Branch> branches;  // in the order of their segments' ids
};

struct JunctionSearch {
  std::optional<Junction> junction;
  std::vector<TileId> absent;  // tiles that the answer would have needed: with them it may be another
};

inline constexpr std::uint32_t kMostJunctionSegments = 4096;

// The nearest fork along the thread from the proxy, within `reach_um`. Where the proxy moves along `heading_W` (any
// length; zero: no heading) the one ahead is preferred to the one behind, however near. Ends of threads are no forks.
// Visits at most `most_segments` segments; none where the place is invalid. Branches are followed for `length_um`, up
// to the next fork. With `somata`, segments that only give a soma its shape are no branches.
JunctionSearch findJunction(const GraphView& graph, const ProxyPlace& place, const Vector3d& heading_W, double reach_um,
                            double length_um, std::uint32_t most_segments = kMostJunctionSegments,
                            SomaFinder* somata = nullptr);

}  // namespace filiform
