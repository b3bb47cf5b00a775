// How long the neurites of cells are, measured on their tiles: the set's records do not hold it.
// Thread rule: thread-compatible.
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform::tools {

class CellLengths {
 public:
  // Finds the tiles that hold the cells. O(cells), and a read for each cell unless all cells are meant.
  CellLengths(const TileStore& store, const std::vector<std::uint32_t>& cells);
  // The number of tiles that measure() reads.
  std::size_t tiles() const { return tiles_.size(); }
  // Sums the lengths of the cells' segments, without those inside a soma that means a sphere (index/cell/soma.h). Calls
  // progress(tiles read) after each tile; what it throws ends the work. Throws CorruptTile, IoError.
  void measure(const std::function<void(std::size_t)>& progress);
  // um; 0 before measure() and for a cell that is not among those given.
  double of(std::uint32_t cell) const { return lengths_um_[cell]; }

 private:
  const TileStore& store_;
  std::vector<TileId> tiles_;
  std::vector<double> lengths_um_;  // by cell
  std::vector<bool> wanted_;        // by cell
};

}  // namespace filiform::tools
