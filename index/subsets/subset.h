// Subsets: cells of a set by place or type, and the samples of a cell by type. index/attributes/cell_filter.h chooses
// cells by attribute.
//
//   std::vector<std::uint32_t> cells = CellFilter({"mtype=L5_*"}).select(*set, CellAttributes(*set));
//   cells = cellsInBox(*set, cells, {set->grid().snap({0, 0, 0}), set->grid().snap({100, 100, 100})});
//   SetCells stream(*set, cells);
//   ingest(stream, "part.fil", {.provenance = [&] { return stream.provenance(); }});
//
// Thread rule: any thread but the haptic one. Errors of the store propagate, and so do exceptions of `check`, which is
// called before each tile.
#pragma once

#include "index/query/cell_graph.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform {

struct SubsetPass {
  unsigned threads = 1;           // that decode tiles, at least 1
  std::function<void()> check{};  // before each tile
};

// Those of `cells` that have a segment, or an isolated sample, that meets the closed box. Exact. Keeps the order.
// O(segments of the tiles that meet the box).
std::vector<std::uint32_t> cellsInBox(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                      const GridBox& box, const SubsetPass& pass = {});

// Those of `cells` that have a sample of one of the SWC types. Keeps the order. O(segments of their tiles).
std::vector<std::uint32_t> cellsWithTypes(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                          const std::vector<std::uint16_t>& types, const SubsetPass& pass = {});

// Removes the samples of all other types, and the links at them. A sample whose parent is removed becomes a root.
// Order, ids and header stay. `somata` becomes empty. Requires types. O(samples * types).
void keepTypes(CellGraph& cell, const std::vector<std::uint16_t>& types);

}  // namespace filiform
