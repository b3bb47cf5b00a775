// What every tile set promises of the cells that it was built from, checked against brute force.
#pragma once

#include "index/cell/cell.h"
#include "index/set/tile_store.h"

#include <vector>

namespace filiform::test {

// All segments of the cells, snapped to the grid, isolated samples included, in the order of their ids. `owned` is true
// throughout.
std::vector<StoredSegment> snappedSegments(const std::vector<Cell>& cells, const Grid& grid);

// Adds a test failure for each broken promise: segments owned once and equal to the input, homes complete, ghosts
// complete and none needless, directory and cell table in agreement with the tiles, attributes as in the input. O(tiles
// * segments).
void expectTilesHold(const TileStore& store, const std::vector<Cell>& cells);

// The two stores hold the same tiles, bit for bit as far as the interface shows.
void expectSameTiles(const TileStore& a, const TileStore& b);
void expectSameTile(const Tile& a, const Tile& b);

}  // namespace filiform::test
