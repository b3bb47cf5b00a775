// The simplified neurites that draw a box, as segments.
// Thread rule: any thread but the haptic one.
#pragma once

#include "index/levels/levels.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform {

struct LevelBox {
  Vector3d lo_W, hi_W;                      // corners that differ, um
  double pixels = 0;                        // the width of the longest side as drawn, finite and above 0
  std::uint64_t most_segments = 2'000'000;  // limits the choice of tiles
  std::function<void()> check{};            // called after each tile; its exceptions propagate
};

struct LevelRow {
  Vector3d child_W, parent_W;
  float radius_um;     // of the child; NaN: unknown
  std::uint16_t type;  // of the child
  std::uint32_t cell;
};

struct LevelRows {
  std::vector<LevelRow> rows;
  double error_um = 0;       // no neurite of the set is farther from its drawn form
  std::uint64_t hidden = 0;  // segments that are left out, because others cover their pixels
  bool limited = false;      // coarser than one pixel, because of most_segments
};

// The segments whose boxes meet the box, from tiles whose error is at most a pixel. Throws UsageError for corners that
// are equal or a width that is not above 0; what Levels and the set throw. O(segments of the tiles).
LevelRows levelRows(const TileSet& set, const Levels& levels, const LevelBox& box);

}  // namespace filiform
