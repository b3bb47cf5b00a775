// One neuron in memory, as trials travel it: all its tiles, and the data that only measurements need (depths, segment
// trees). Built from a cell by the tiler that ingest uses. Thread rule: belongs to one thread.
#pragma once

#include "index/cell/cell.h"
#include "index/query/cell_graph.h"
#include "index/set/tile_store.h"
#include "index/streaming/tile_table.h"
#include "solver/graph/graph_view.h"
#include "solver/proxy/parameters.h"
#include "tools/lab/evaluate/trials/segment_tree.h"

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

struct CellTreatment {          // changes made to a cell before it is tiled
  bool round_to_float = false;  // round positions to 24 bits, as a program in single precision does
  double offset_um = 0;         // added to x before rounding: moves the cell away from the origin
  friend auto operator<=>(const CellTreatment&, const CellTreatment&) = default;
};

class TrialCell {
 public:
  // Throws UsageError as buildTilesInMemory() does. O(n log n); about 300 bytes a segment.
  explicit TrialCell(Cell cell, const CellTreatment& treatment = {});
  TrialCell(const TrialCell&) = delete;
  TrialCell& operator=(const TrialCell&) = delete;

  const CellGraph& graph() const { return graph_; }
  const GraphView& view() const { return *view_; }
  const TileTable& tiles() const { return *table_; }
  const SolverParameters& parameters() const { return parameters_; }  // automatic, from this cell

  std::uint32_t root(std::uint32_t rank) const { return root_[rank]; }
  double depth_um(std::uint32_t rank) const { return depth_um_[rank]; }   // arc length from the root
  std::uint32_t level(std::uint32_t rank) const { return level_[rank]; }  // links from the root
  // The segments of the tree with this root. Built at the first call.
  const SegmentTree& tree(std::uint32_t root);

  // The place at t of the segment with this child.
  ProxyPlace placeAt(std::uint32_t child, double t, const Vector3d& p_W) const noexcept;
  ProxyPlace placeAt(std::uint32_t child, double t) const noexcept;

 private:
  std::unique_ptr<TileStore> store_;
  std::vector<std::shared_ptr<const Tile>> held_;
  std::unique_ptr<TileTable> table_;
  std::unique_ptr<GraphView> view_;
  CellGraph graph_;
  SolverParameters parameters_;
  std::vector<std::uint32_t> root_, level_;
  std::vector<double> depth_um_;
  struct Stored {
    const Tile* tile = nullptr;
    std::uint32_t segment = 0;
  };
  std::vector<Stored> stored_;  // by rank of the child: the tile that owns the segment
  std::map<std::uint32_t, SegmentTree> trees_;
};

// Rounds to 24 bits.
Vector3d toSinglePrecision(const Vector3d& p);

}  // namespace filiform::tools
