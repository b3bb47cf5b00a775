// Level tiles, the view for which tiles are chosen, and the choice (index/levels/levels.h). Thread rule: values.
#pragma once

#include "index/geometry/grid.h"
#include "index/geometry/morton.h"

#include <cstdint>
#include <limits>
#include <vector>

namespace filiform {

using LevelId = std::uint32_t;  // rank among the level tiles: a block before the blocks inside it, by lowest key

// What the levels' directory states about one level tile.
struct LevelEntry {
  BlockKey key;
  std::uint32_t coarser = 0;   // of several tiles of a block: how many of them are finer
  int exponent = 0;            // of the tile's grid, which may be coarser than the set's
  GridBox content;             // of its segments, not clipped; empty without segments
  std::uint32_t segments = 0;  // balls included
  double error_um = 0;         // largest distance between what its segments represent and these segments
  // Full-resolution segments owned by the tiles below, isolated ones included: together all of them. From afar, other
  // segments of the tile cover the pixels of hidden ones.
  std::uint64_t represented = 0, hidden = 0;
  double pixel_um = 0;              // the size of such a pixel; 0: no segment is hidden
  double hidden_um = 0;             // length of the hidden segments
  std::uint64_t decoded_bytes = 0;  // Tile::bytes() after loading
};

// The view for which tiles are chosen.
struct LevelView {
  struct Plane {  // n . p >= d is inside
    Vector3d n;
    double d;
  };
  std::vector<Plane> planes;  // of the frustum or box, um; empty: everything is visible
  Vector3d eye_W = Vector3d::Zero();
  // Pixels for an angle of one radian. If orthographic: pixels for one um; the distance then has no effect.
  double pixels_per_rad = 1000;
  bool orthographic = false;
  double nearest_um = 0;  // nothing nearer to the eye is seen: errors there count as if at this distance
};

// One chosen tile.
struct LevelPart {
  bool level;          // true: a level tile; false: a full-resolution tile
  std::uint32_t tile;  // LevelId or TileId
  std::uint32_t segments;
  double error_px;  // error on the screen; 0 in full resolution
};

// The chosen tiles.
struct LevelChoice {
  std::vector<LevelPart> parts;  // largest error first
  std::uint64_t segments = 0;    // of the parts
  double error_px = 0;           // largest error of the parts
  std::uint64_t hidden = 0;      // full-resolution segments that no part represents: others cover their pixels
  bool limited = false;          // a part is coarser than asked for, because of the limit on segments
  // With UnreadTiles::leave: level tiles whose parts below must be known before the choice can be finer.
  std::vector<LevelId> unread = {};
};

// What choose() does where a finer part needs pages of the set's directory that are not read yet.
enum class UnreadTiles : std::uint8_t {
  read,   // reads them
  leave,  // keeps the coarser part; call below() for each of LevelChoice::unread on any thread, then choose again
};

inline constexpr LevelId kLevelRoots = std::numeric_limits<LevelId>::max();  // above the topmost tiles

}  // namespace filiform
