// Measures the cells of a tile set.
#pragma once

#include "index/measure/cell_measures.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform {

// How the cells of a set are measured.
struct SetMeasureOptions {
  MeasureOptions measures;
  unsigned threads = 1;
  std::uint64_t memory_bytes = 256 << 20;  // as CellPass has it
  std::function<void()> check{};           // called before each tile and each group of cells; its exceptions propagate
};

// Calls take(cell, measures) for each of `cells`, in this order, on the calling thread. The order of threads changes no
// bit of the measures. Sets MeasuredPart::sample_id. Requires that the cells differ and are below cell_count().
// Throws what CellPass and measuresOf() throw. Thread rule: any thread may call it; it starts its own. O(samples), and
// one pass over the tiles of the cells.
void measureCells(const TileStore& store, const std::vector<std::uint32_t>& cells, const SetMeasureOptions& options,
                  const std::function<void(std::uint32_t cell, const CellMeasures& measures)>& take);

}  // namespace filiform
