// Cells cut by the product's tiler, for tests of the solver.
#pragma once

#include "index/ingest/memory_tiles.h"
#include "solver/graph/graph_view.h"
#include "tests/support/scenes/random_cells.h"

#include <memory>
#include <vector>

namespace filiform::test {

// The product's tiles, all in memory, and their segments for the oracle.
struct StoreGraph {
  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> tiles;
  TileTable table{0};
  std::vector<StoredSegment> owned;
  std::vector<TileId> owners;  // of `owned`

  StoreGraph(const std::vector<Cell>& cells, std::uint32_t capacity) {
    CellList stream(cells);
    store = buildTilesInMemory(stream, {.capacity = capacity});
    table = TileTable(store->tile_count());
    for (TileId id = 0; id < store->tile_count(); ++id) {
      tiles.push_back(store->load(id));
      const Tile& tile = *tiles.back();
      table.add(tile);
      for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
        if (!tile.owned(s)) continue;
        const std::uint32_t child = tile.child(s), parent = tile.parent(s);
        owned.push_back({tile.segmentId(s), tile.nodeId(child).sample, tile.nodeId(parent).sample,
                         tile.gridPoint(child), tile.gridPoint(parent), true});
        owners.push_back(id);
      }
    }
  }

  GraphView view() const { return GraphView(table, store->leaves(), store->grid()); }
};

}  // namespace filiform::test
