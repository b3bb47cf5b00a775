// A whole cell read back from a set of tiles: for export, and for planning routes along it.
#pragma once

#include "index/tile_store.h"

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace filiform {

// Thread-compatible. Samples by rank, as in Cell; positions on the grid.
struct CellGraph {
  std::string name, source;
  Grid grid;
  std::vector<GridPoint> positions;
  std::vector<std::uint32_t> parents;  // rank, kNoParent for a root
  std::vector<std::int64_t> sample_ids;
  std::vector<std::uint32_t> block_starts;
  std::vector<float> radii_um;       // empty unless asked for
  std::vector<std::uint16_t> types;  // likewise

  std::size_t samples() const { return positions.size(); }
  Vector3d position_W(std::uint32_t rank) const { return grid.toWorld(positions[rank]); }
};

// Reads every tile that owns a segment of the cell. Requires cell < store.cell_count(). Throws CorruptSet when a sample
// is missing or there twice, or two tiles disagree on where it is; what the store throws. O(segments of those tiles).
CellGraph readCell(const TileStore& store, std::uint32_t cell, bool with_appearance);

// Writes the cell as SWC: original ids in file order, positions as the shortest decimals that read back as the same
// grid point, radii as those that read back as the same float, NaN where unknown. Ids of restarted blocks are moved
// past the highest before, and a comment says so. Requires radii and types. The stream's state tells of write errors.
void writeSwc(std::ostream& out, const CellGraph& cell);

}  // namespace filiform
