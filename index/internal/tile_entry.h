// What the directory says of a tile, computed from the tile itself.
#pragma once

#include "index/tile_store.h"

namespace filiform::internal {

// The box of the part of segment a-b that lies in `cell`, rounded outward to the grid; empty when the boxes do not
// meet.
GridBox clippedBox(const GridPoint& a, const GridPoint& b, const GridBox& cell);

TileEntry entryOf(const Tile& tile);  // O(segments)

}  // namespace filiform::internal
