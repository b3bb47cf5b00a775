// A whole cell read back from a tile set, for export and route planning.
#pragma once

#include "index/cell/soma.h"
#include "index/set/tile_store.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace filiform {

// One cell; samples by rank, as in Cell, with positions on the grid. Thread rule: thread-compatible.
struct CellGraph {
  std::string name, source;
  Grid grid;
  std::vector<GridPoint> positions;
  // Rank of the parent, kNoParent for a root. For a cell with loops: the spanning forest that connect() finds. Routes
  // follow this forest.
  std::vector<std::uint32_t> parents;
  // {child, parent} by rank of the segment, as in Cell. Empty for a cell without loops.
  std::vector<std::array<std::uint32_t, 2>> links;
  std::vector<std::int64_t> sample_ids;
  std::vector<std::uint32_t> block_starts;
  std::vector<float> radii_um;       // empty without appearance
  std::vector<double> odd_radii_um;  // by rank: odd radii (index/cell/radius.h), else NaN; empty if there are none
  std::string header;                // as in Cell
  std::vector<std::uint16_t> types;  // empty without appearance
  CellSomata somata;                 // off_roots only with appearance

  std::size_t samples() const { return positions.size(); }
  bool isGraph() const { return !links.empty(); }
  double oddRadius_um(std::uint32_t rank) const { return odd_radii_um.empty() ? kUnknownRadius : odd_radii_um[rank]; }
  Vector3d position_W(std::uint32_t rank) const { return grid.toWorld(positions[rank]); }
};

// The links as {parent, child} by rank, in the order of their segments; without isolated samples. O(samples).
std::vector<std::array<std::uint32_t, 2>> parentLinks(const CellGraph& cell);

// Reads every tile that owns a segment of the cell. With `with_appearance`, also reads radii and types. Requires cell <
// store.cell_count(). Throws CorruptSet if a sample is missing, a segment has two owners, or tiles disagree on a
// position; also what the store throws; Interrupted before the next tile once `stop` is true. O(segments of those
// tiles).
CellGraph readCell(const TileStore& store, std::uint32_t cell, bool with_appearance,
                   const std::atomic<bool>* stop = nullptr);

// Writes the cell as SWC, with original ids in file order. Positions have the fewest decimals that read back as the
// same grid point; radii read back as the same number, but an unknown one is written as 0. The source's header lines
// come first. Ids of restarted blocks change (see distinctIds()), and a comment in the file states this. Requires radii
// and types. Throws InputError for a cell with loops, which SWC cannot hold. Write errors set the stream's state.
void writeSwc(std::ostream& out, const CellGraph& cell);

// Writes the source's header lines, then those of `lines` that are not among them, each with a line end.
void writeHeader(std::ostream& out, const CellGraph& cell, const std::vector<std::string>& lines);

// The ids that writeSwc() writes: distinctIds() of cell.h. O(samples).
std::vector<std::int64_t> distinctIds(const CellGraph& cell);

}  // namespace filiform
