// Threads made simpler within a stated error, for the eye: what a tile of a level of detail is made of.
//
// A thread graph holds the segments that one cell of the partition owns, or those that its parts have kept. Simplifying
// replaces runs (between branch points, tips and nodes where threads leave the cell) by fewer segments between nodes
// that were there before (Douglas and Peucker 1973, Ramer 1972), and takes away twigs that lie wholly within the
// tolerance of the node that they hang on. So branch points, threads' ends, crossings and the number of connected
// pieces stay; only a budget of segments makes whole cells go, the shortest first. Nothing is moved. Thread rule:
// values and functions without state.
#pragma once

#include "index/tile.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

struct ThreadNode {
  NodeId id;
  GridPoint p;
  std::uint32_t full = 0;  // segments at it in the whole set; 0: not known yet, so that it is never taken away
  std::uint32_t seen = 0;  // of these, how many came into this graph, dropped ones included
  double absorbed_um = 0;  // what was taken away and is stood for by this node lies so near
};

struct ThreadSegment {
  std::uint32_t child, parent;  // among the graph's nodes; equal: a node that stands for itself
  double error_um = 0;          // between the segment and what it stands for, at most (Hausdorff)
  float radius_um = 0;          // mean, NaN where unknown
  std::uint16_t type = 0;
};

struct ThreadShare {  // of one cell, in full resolution: what is in the graph or stood for by it
  std::uint32_t cell;
  std::uint64_t segments = 0;  // isolated ones included
  double length_um = 0;
};

struct ThreadGraph {
  std::vector<ThreadNode> nodes;  // each once, in any order
  std::vector<ThreadSegment> segments;
  std::vector<ThreadShare> shares;  // ascending by cell
  std::uint64_t dropped = 0;        // full-resolution segments of cells that were dropped
  double dropped_um = 0;
};

// What a tile owns. O(segments).
ThreadGraph threadsOf(const Tile& tile, const TileAppearance& appearance, const Grid& grid);

// One graph of several that share nodes but no segments. O(n + shared log shared).
ThreadGraph join(std::vector<ThreadGraph> graphs);

struct SimplifyOptions {
  double tolerance_um = 0;       // aimed at
  double most_tolerance_um = 0;  // where there are too many segments; beyond, whole cells go
  std::size_t most_segments = 2048;
};

// Requires 0 < tolerance_um <= most_tolerance_um. The error of every segment and node that is left is at most the
// tolerance that was needed, unless it was larger before. One cell always stays, and may exceed most_segments where its
// threads leave the graph in more places. Deterministic. O(n log n) as a rule, O(n^2) at worst for a run of n.
ThreadGraph simplify(const ThreadGraph& graph, const Grid& grid, const SimplifyOptions& options);

// The largest error of its segments and nodes.
double errorOf(const ThreadGraph& graph);

// The graph as segments of a tile, with sample numbers of their own, given along the threads (a node that is the child
// of several segments has several), each named after its child; `appearance` in the same order.
std::vector<StoredSegment> numbered(const ThreadGraph& graph, TileAppearance& appearance);

}  // namespace filiform
