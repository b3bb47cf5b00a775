// SetCells: cells of a tile set as a stream, from which ingest() makes another set; index/subsets/subset.h has an
// example.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/query/cell_pass.h"
#include "index/set/provenance.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform {

struct SetCellsOptions {
  std::vector<std::uint16_t> types{};      // only samples of these SWC types, as keepTypes() has it; empty: all
  std::uint64_t memory_bytes = 256 << 20;  // as CellPassOptions has it
  unsigned threads = 1;                    // that decode tiles, at least 1
  std::function<void()> check{};           // called before each tile; its exceptions propagate from next()
};

// The cells come with their names, ids, radii, headers, attributes and digests, and with positions on the set's grid.
// So ingest() of all cells, with the set's capacity and quantum, gives a set with the same tiles, and ingest() of some
// the tiles of a set that was made from these alone. Thread rule: thread-compatible.
class SetCells final : public CellStream {
 public:
  // Reads nothing but records of cells. `set` must outlive this object. Requires that the cells differ, are below
  // cell_count() and are not removed. O(cells log cells).
  SetCells(const TileSet& set, std::vector<std::uint32_t> cells, SetCellsOptions options = {});

  // The cells in the order in which next() gives them.
  const std::vector<std::uint32_t>& cells() const { return cells_; }

  // Cells without a sample of the types are left out. Throws what CellPass throws. Memory and cost are those of
  // CellPass.
  bool next(Cell& cell) override;

  // The sources of the cells, with their number of chosen cells. What was refused, skipped or remarked when the set was
  // made is not a part of it. Throws CorruptSet, IoError. O(sources + cells).
  Provenance provenance() const;

 private:
  const TileSet& set_;
  std::vector<std::uint32_t> cells_;  // in the order of ingest
  std::vector<std::uint16_t> types_;
  CellAttributes attributes_;
  CellPass pass_;
  std::size_t at_ = 0;
};

// The sources of cells of a set, ascending by name, each with its number of these cells. Throws as above.
std::vector<Provenance::Source> sourcesOfCells(const TileSet& set, const std::vector<std::uint32_t>& cells);

}  // namespace filiform
