// The branches at the node that the proxy approaches (the paper, 4): which there are, where they lead, and how they are
// drawn, the proxy's own told apart from the others by colour and by shape. Pure functions; the thread that owns the
// tile table.
#pragma once

#include "index/soma_finder.h"
#include "solver/graph_view.h"
#include "viewer/thread_batches.h"

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

struct GlyphPalette {
  Rgba own, other;
};
inline constexpr GlyphPalette kRedGreen{{235, 60, 50, 255}, {70, 200, 90, 255}};      // the paper's
inline constexpr GlyphPalette kOrangeBlue{{255, 150, 20, 255}, {70, 150, 255, 255}};  // told apart by all readers
// Through red and cyan glasses a red is dark and hues are next to lost: these differ by brightness.
inline constexpr GlyphPalette kForGlasses{{255, 240, 90, 255}, {50, 130, 255, 255}};

// Round cones about the junction at the origin: the proxy's own branch is a thick line with a filled head, the others
// are thin with a ring for a head. Every branch is drawn `length_um` long, in the direction and with the course that it
// has, stretched if it is shorter. `line_um` is the thickness of a thin line.
ThreadBatch glyphBatch(const Junction& junction, double length_um, double line_um,
                       const GlyphPalette& palette = kRedGreen);

}  // namespace filiform
