// A whole cell read back from a set of tiles: for export, and for planning routes along it.
#pragma once

#include "index/soma.h"
#include "index/tile_store.h"

#include <array>
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
  // Rank, kNoParent for a root. Of a cell with loops, the spanning forest that connect() finds: routes keep to it.
  std::vector<std::uint32_t> parents;
  // {child, parent} by rank of the segment, as in Cell; only of a cell with loops.
  std::vector<std::array<std::uint32_t, 2>> links;
  std::vector<std::int64_t> sample_ids;
  std::vector<std::uint32_t> block_starts;
  std::vector<float> radii_um;       // empty unless asked for
  std::vector<std::uint16_t> types;  // likewise
  CellSomata somata;                 // what the soma's samples mean; off_roots only where the types are there

  std::size_t samples() const { return positions.size(); }
  bool isGraph() const { return !links.empty(); }
  Vector3d position_W(std::uint32_t rank) const { return grid.toWorld(positions[rank]); }
};

// Is the cell a graph with loops, whose segments are named by their place among its links (see Cell)? Then it has more
// links than a forest.
inline bool hasLoops(const CellRecord& cell) { return cell.segments + cell.roots > cell.samples; }

// Reads every tile that owns a segment of the cell. Requires cell < store.cell_count(). Throws CorruptSet when a sample
// is missing or there twice, or two tiles disagree on where it is; what the store throws. O(segments of those tiles).
CellGraph readCell(const TileStore& store, std::uint32_t cell, bool with_appearance);

// Writes the cell as SWC: original ids in file order, positions with the fewest decimals that read back as the same
// grid point, radii as those that read back as the same float, NaN where unknown. Ids of restarted blocks are moved
// past the highest before, and a comment says so. Requires radii and types. Throws InputError for a cell with loops,
// which SWC cannot hold. The stream's state tells of write errors.
void writeSwc(std::ostream& out, const CellGraph& cell);

// The ids that writeSwc writes: every block after the first moved past the highest before it, or 1, 2, 3 ... where that
// does not fit 64 bits. O(samples).
std::vector<std::int64_t> distinctIds(const CellGraph& cell);

}  // namespace filiform
