// The box that an overview of a set frames: without the few segments that lie far from all others.
#pragma once

#include "index/set/tile_store.h"

#include <span>

namespace filiform {

// On each axis, the interval from the lowest to the highest 2 % of the segments, by the boxes of their tiles, widened
// by half its length on both sides. The result is the box of the tiles that lie in the three intervals, cut to them. If
// the box of all segments is at most twice as long on every axis, the result is that box. `entries`: by TileId. Thread
// rule: a function without state. O(tiles log tiles).
UsualBox usualBoxOf(std::span<const TileEntry> entries, TileId long_tile);

}  // namespace filiform
