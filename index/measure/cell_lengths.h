// The lengths of cells, measured on their tiles because the set does not record them. Thread rule: thread-compatible.
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform::tools {

class CellLengths {
 public:
  // Finds the tiles that hold the cells. O(cells); reads one record a cell unless all cells are given.
  CellLengths(const TileStore& store, const std::vector<std::uint32_t>& cells);
  // The number of tiles that measure() reads.
  std::size_t tiles() const { return tiles_.size(); }
  // Sums the lengths of the cells' segments. Segments inside a soma that stands for a sphere do not count
  // (index/cell/soma.h). Calls progress(tiles read) after each tile; exceptions from `progress` propagate. Throws
  // CorruptTile, IoError.
  void measure(const std::function<void(std::size_t)>& progress);
  // The length, um; 0 before measure() and for a cell that was not given.
  double of(std::uint32_t cell) const { return lengths_um_[cell]; }

 private:
  const TileStore& store_;
  std::vector<TileId> tiles_;
  std::vector<double> lengths_um_;  // by cell
  std::vector<bool> wanted_;        // by cell
};

}  // namespace filiform::tools
