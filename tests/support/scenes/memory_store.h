// Cells in memory, cut by the product's tiler into small tiles.
#pragma once

#include "index/ingest/memory_tiles.h"

#include <memory>
#include <utility>
#include <vector>

namespace filiform::test {

inline std::unique_ptr<TileStore> storeOf(std::vector<Cell> cells, std::uint32_t capacity = 64) {
  CellList stream(std::move(cells));
  return buildTilesInMemory(stream, {.capacity = capacity});
}

}  // namespace filiform::test
