// Small graphs for tests of the solver, loops allowed, and their tiles in memory. The tiler shares nothing with the
// product's tiler.
#pragma once

#include "index/streaming/tile_table.h"
#include "index/tile/leaf_index.h"

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

namespace filiform::test {

// A graph as one flat list of segments. The `owned` flags have no meaning here.
struct TestGraph {
  Grid grid;
  std::vector<StoredSegment> segments;
};

// Adds nodes and segments one by one. A segment has the rank of its child, except in loops.
class TestGraphBuilder {
 public:
  explicit TestGraphBuilder(const Grid& grid = Grid()) { graph_.grid = grid; }

  // Returns the number of the node.
  std::uint32_t node(const Vector3d& p_W) { return node(0, p_W); }
  std::uint32_t node(std::uint32_t cell, const Vector3d& p_W);
  // The segment's rank is the child's number; allowed once a child. Returns the number of the segment.
  std::uint32_t link(std::uint32_t child, std::uint32_t parent);
  // Any number of segments a child: ranks from 1 000 000, in the order of calls.
  std::uint32_t loop(std::uint32_t child, std::uint32_t parent);

  std::size_t nodes() const { return nodes_.size(); }
  NodeId id(std::uint32_t node) const { return nodes_[node].id; }
  Vector3d position_W(std::uint32_t node) const { return graph_.grid.toWorld(nodes_[node].point); }
  // Returns the graph so far. Nodes without a segment become isolated (a segment from the sample to itself).
  TestGraph build() const;

 private:
  struct Node {
    NodeId id;
    GridPoint point;
    bool linked;
  };
  std::uint32_t add(std::uint32_t child, std::uint32_t parent, std::uint32_t rank);

  TestGraph graph_;
  std::vector<Node> nodes_;
  std::uint32_t loops_ = 0;
};

// A few cells of winding, branching neurites in one tangle about `centre_W`. Segments are about 1 um long; some have
// length zero. With coincident nodes, hubs, isolated nodes and, if requested, loops (self-loops too).
TestGraph randomGraph(std::mt19937_64& random, std::uint32_t nodes, bool loops,
                      const Vector3d& centre_W = Vector3d::Zero());

// The graph as tiles of at most `capacity` segments (more if a block cannot be split), all in memory.
class TiledGraph {
 public:
  TiledGraph(const TestGraph& graph, std::uint32_t capacity);

  const TileTable& table() const { return table_; }
  const LeafIndex& leaves() const { return leaves_; }
  std::size_t tile_count() const { return tiles_.size(); }
  const Tile& tile(TileId id) const { return *tiles_[id]; }
  // The lowest tile that stores the segment.
  TileId tileOf(SegmentId id) const;
  void load(TileId id) { table_.add(*tiles_[id]); }
  void drop(TileId id) { table_.retire(id); }
  void dropAll() {
    for (TileId id = 0; id < tiles_.size(); ++id) drop(id);
  }

 private:
  std::vector<std::unique_ptr<Tile>> tiles_;
  LeafIndex leaves_;
  TileTable table_;
};

}  // namespace filiform::test
