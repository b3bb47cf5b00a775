// Simplifies neurites within a stated error, for drawing: makes the content of one tile of a level of detail.
//
// A NeuriteGraph holds the segments that one block of the partition owns, or what remains of its parts. Simplifying
// replaces a run by fewer segments between existing nodes (Douglas and Peucker 1973, Ramer 1972). A run ends at branch
// points, tips and nodes where neurites leave the block. Simplifying also removes twigs that lie within the tolerance
// of the node that carries them.
//
// Branch points, tips, crossings and the number of connected pieces stay. No node moves. Only a limit on segments
// removes whole cells, the shortest first. Thread rule: values and functions without state.
#pragma once

#include "index/tile/tile.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

// A node of the graph.
struct NeuriteNode {
  NodeId id;
  GridPoint p;
  std::uint32_t full = 0;  // its segments in the whole set; 0: not known yet, so the node is never removed
  std::uint32_t seen = 0;  // of these, how many came into this graph, dropped ones included
  double absorbed_um = 0;  // the removed parts that this node represents lie within this distance
};

// A segment of the graph.
struct NeuriteSegment {
  std::uint32_t child, parent;  // nodes of the graph; equal: an isolated node
  double error_um = 0;          // largest distance (Hausdorff) between the segment and what it represents
  float radius_um = 0;          // mean, NaN where unknown
  std::uint16_t type = 0;
};

struct NeuriteShare {  // of one cell, in full resolution: what the graph holds or represents
  std::uint32_t cell;
  std::uint64_t segments = 0;  // isolated ones included
  double length_um = 0;
};

struct NeuriteGraph {
  std::vector<NeuriteNode> nodes;  // each once, in any order
  std::vector<NeuriteSegment> segments;
  std::vector<NeuriteShare> shares;  // ascending by cell
  std::uint64_t dropped = 0;         // full-resolution segments of cells that were dropped
  double dropped_um = 0;
};

// The graph of the segments that the tile owns. O(segments).
NeuriteGraph neuritesOf(const Tile& tile, const TileAppearance& appearance, const Grid& grid);

// Joins graphs that share nodes but no segments. O(n + shared log shared).
NeuriteGraph join(std::vector<NeuriteGraph> graphs);

struct SimplifyOptions {
  double tolerance_um = 0;       // the aim
  double most_tolerance_um = 0;  // limit if there are too many segments; beyond it, whole cells are removed
  std::size_t most_segments = 2048;
};

// Simplifies `graph`. While more than most_segments remain, the tolerance grows from tolerance_um to at most
// most_tolerance_um; then whole cells are dropped. If the last cell alone exceeds most_segments, the tolerance doubles
// up to 24 times. This cell may still exceed most_segments if its neurites leave the graph in more places.
//
// The error of each remaining segment and node is at most the last tolerance, unless it was larger before. Requires 0 <
// tolerance_um <= most_tolerance_um. Deterministic. O(n log n) usually, O(n^2) at worst for a run of n.
NeuriteGraph simplify(const NeuriteGraph& graph, const Grid& grid, const SimplifyOptions& options);

// The largest error of the graph's segments and nodes.
double errorOf(const NeuriteGraph& graph);

// Converts the graph to the segments of a tile. Nodes get new sample numbers along the neurites; a node that is the
// child of several segments gets several numbers. A segment is named after its child. Fills `appearance` in the same
// order.
std::vector<StoredSegment> numbered(const NeuriteGraph& graph, TileAppearance& appearance);

}  // namespace filiform
