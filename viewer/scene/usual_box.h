// The box that an overview frames: without the few segments that lie far from all others.
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>

namespace filiform {

struct UsualBox {
  GridBox box;                // empty without segments
  std::uint64_t outside = 0;  // segments of tiles outside the box; 0: the box is that of all segments
};

// On each axis, the interval from the lowest to the highest 2 % of the segments, by the boxes of their tiles, widened
// by half its length on both sides. The result is the box of the tiles that lie in the three intervals, cut to them. If
// the box of all segments is at most twice as long on every axis, the result is that box. Depends on the directory
// only. Thread rule: a function without state. O(tiles log tiles).
UsualBox usualBox(const TileStore& store);

}  // namespace filiform
