// The fork that the proxy approaches: its branches, and where they lead (the paper, 4). Thread rule: pure functions;
// call them on the thread that owns the tile table.
#pragma once

#include "index/query/soma_finder.h"
#include "solver/graph/graph_view.h"

#include <optional>
#include <vector>

namespace filiform {

struct Branch {
  std::vector<Vector3d> points_W;           // from the junction outwards, up to the requested length; at least two
  SegmentId first{UINT32_MAX, UINT32_MAX};  // the branch's segment at the junction
  bool own = false;                         // the proxy is on this branch
};

struct Junction {  // a node where more than two branches meet: a fork or a crossing
  NodeId node{UINT32_MAX, UINT32_MAX};
  Vector3d p_W = Vector3d::Zero();
  double distance_um = 0;        // from the proxy, along the neurite
  std::vector<Branch> branches;  // in the order of their segments' ids
};

struct JunctionSearch {
  std::optional<Junction> junction;
  std::vector<TileId> absent;  // tiles that the search needed; with these tiles the result may differ
};

inline constexpr std::uint32_t kMostJunctionSegments = 4096;

// Finds the nearest fork along the neurite from the proxy, within `reach_um`. If the proxy moves along `heading_W` (any
// length; zero: no heading), a fork ahead is preferred to a fork behind, however near. Tips are not forks. Visits at
// most `most_segments` segments. Finds nothing if the place is invalid. Each branch is traced for `length_um`, or up to
// the next fork. With `somata`, segments that only give a soma its shape do not count as branches.
JunctionSearch findJunction(const GraphView& graph, const ProxyPlace& place, const Vector3d& heading_W, double reach_um,
                            double length_um, std::uint32_t most_segments = kMostJunctionSegments,
                            SomaFinder* somata = nullptr);

}  // namespace filiform
