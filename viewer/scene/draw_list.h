// What to draw of a set: the tiles in the picture, coarse to fine by their error on the screen, within a budget of
// segments. What is left out is counted, never hidden. A pure function of its arguments; thread-compatible.
#pragma once

#include "index/set/levels.h"
#include "index/set/tile_store.h"

namespace filiform {

struct DrawList {
  std::vector<LevelPart> parts;  // coarsest first
  std::uint64_t segments = 0;    // of the parts
  double error_px = 0;           // of what the parts stand for, the largest
  // Full-resolution segments in the picture's tiles that no part stands for: dropped by levels, or, without levels, in
  // the tiles farthest from the focus.
  std::uint64_t left_out = 0;
  std::uint64_t tiles_left_out = 0;
};

// With levels: Levels::choose(), whose roots are always drawn, so that `segments` may exceed a tiny budget. Without
// (nullptr): whole tiles in full resolution, nearest to the focus first (the long-segment tile before all), until the
// next one would exceed the budget; tiles that still fit follow. O(tiles log tiles).
DrawList chooseTiles(const TileStore& store, const Levels* levels, const LevelView& view, const Vector3d& focus_W,
                     std::uint64_t most_segments, double enough_px = 0.5);

}  // namespace filiform
