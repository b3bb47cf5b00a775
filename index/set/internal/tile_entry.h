// Computes a tile's directory entry from the tile.
#pragma once

#include "index/set/tile_store.h"

namespace filiform::internal {

// The box of the part of segment a-b inside `block`, rounded outward to the grid. Empty if the boxes do not meet.
GridBox clippedBox(const GridPoint& a, const GridPoint& b, const GridBox& block);

TileEntry entryOf(const Tile& tile);  // O(segments)

}  // namespace filiform::internal
