// Chooses the tiles to draw: those in view, as fine as their error on the screen requires, within a budget of segments.
// Counts all segments that are left out. A pure function of its arguments; thread-compatible.
#pragma once

#include "index/levels/levels.h"
#include "index/set/tile_store.h"

namespace filiform {

struct DrawList : LevelChoice {
  std::uint64_t left_out = 0;  // without levels: segments of the tiles in view beyond the budget
  std::uint64_t tiles_left_out = 0;
};

// With levels: Levels::choose(). It always chooses the coarsest tile, so that `segments` may exceed a tiny budget.
// Without levels (nullptr): tiles in full resolution, the long-segment tile first, then by distance to the focus; a
// tile that would exceed the budget is skipped. O(tiles log tiles).
DrawList chooseTiles(const TileStore& store, const Levels* levels, const LevelView& view, const Vector3d& focus_W,
                     std::uint64_t most_segments, double enough_px = Levels::kEnough_px,
                     UnreadTiles unread = UnreadTiles::read);

}  // namespace filiform
