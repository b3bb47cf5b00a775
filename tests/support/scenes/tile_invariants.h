// Checks the promises of a tile set about the cells that it was built from, against brute force.
#pragma once

#include "index/cell/cell.h"
#include "index/set/tile_store.h"

#include <vector>

namespace filiform::test {

// All segments of the cells, snapped to the grid, with isolated samples, by id. `owned` is true for all.
std::vector<StoredSegment> snappedSegments(const std::vector<Cell>& cells, const Grid& grid);

// Adds a test failure for each broken promise: segments owned once and equal to the input, homes complete, ghosts
// complete and none needless, tile finder and cell table in agreement with the tiles, attributes as in the input.
// O(tiles * segments).
void expectTilesHold(const TileStore& store, const std::vector<Cell>& cells);

// Expects that the two stores hold the same tiles, bit for bit as far as the interface shows.
void expectSameTiles(const TileStore& a, const TileStore& b);
void expectSameTile(const Tile& a, const Tile& b);

}  // namespace filiform::test
