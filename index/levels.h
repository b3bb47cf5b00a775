// Levels of detail of a tile set, for the eye: inner cells of the partition, each with its threads made simpler within
// an error that it states (simplify.h). The hand always feels full resolution.
//
//   const auto levels = Levels::open(*set);
//   const LevelChoice choice = levels->choose(view, 2'000'000);
//   for (const LevelPart& part : choice.parts)
//     const auto tile = part.level ? levels->load(part.tile) : set->load(part.tile);
//
// Of a tile of the set, draw what it owns.
#pragma once

#include "index/tile_set.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace filiform {

using LevelId = std::uint32_t;  // rank among the level tiles: a cell before those inside it, by lowest key

struct LevelEntry {
  CellKey key;      // its depth is a multiple of three
  GridBox content;  // of its segments, not clipped; empty where it has none
  std::uint32_t segments = 0;
  double error_um = 0;  // what it stands for lies within this of its segments, and they within this of it
  std::uint64_t represented = 0, dropped = 0;  // full-resolution segments, isolated ones included, that the tiles below
                                               // own: together all of them
  double dropped_um = 0;                       // length of those that are left out
  std::uint64_t decoded_bytes = 0;             // Tile::bytes() after loading
};

// What is looked at.
struct LevelView {
  struct Plane {  // n . p >= d is inside
    Vector3d n;
    double d;
  };
  std::vector<Plane> planes;  // of the frustum or box, um; none: everything
  Vector3d eye_W = Vector3d::Zero();
  // Pixels that an angle of one radian takes; orthographic: pixels a um, and the distance does not count.
  double pixels_per_rad = 1000;
  bool orthographic = false;
};

struct LevelPart {
  bool level;          // else a tile in full resolution
  std::uint32_t tile;  // LevelId or TileId
  std::uint32_t segments;
  double error_px;  // on the screen; 0 in full resolution
};

struct LevelChoice {
  std::vector<LevelPart> parts;  // coarsest error first
  std::uint64_t segments = 0;    // of the parts
  double error_px = 0;           // the largest of the parts'
  std::uint64_t dropped = 0;     // full-resolution segments that no part stands for
};

// Thread rule: immutable after open(), internally synchronised as the set is.
class Levels {
 public:
  // The set must outlive it. nullptr where it was made without levels. Throws CorruptSet, IoError. O(tiles).
  static std::unique_ptr<Levels> open(const TileSet& set);
  ~Levels();

  LevelId size() const;
  const LevelEntry& entry(LevelId level) const;
  std::uint64_t bytes() const;  // on disk, of all files of the levels

  // Nodes are numbered along the threads, anew in each tile (they are no samples); cells are those of the set. Every
  // segment is owned; nothing is home. Throws CorruptTile (with the level's id), IoError.
  std::shared_ptr<const Tile> load(LevelId level) const;
  TileAppearance loadAppearance(LevelId level) const;

  // The level tiles and full-resolution tiles right below; of no level: the roots.
  std::span<const LevelPart> below(LevelId level) const;
  static constexpr LevelId kRoots = std::numeric_limits<LevelId>::max();

  // How wrong the level tile is on the screen, in pixels, what it drops counted by its share; infinite where the eye is
  // within its box.
  double errorOnScreen(LevelId level, const LevelView& view) const;

  // Tiles that together show what lies in the view, each place once: from the roots on, whatever is coarsest on the
  // screen is replaced by the tiles below it while they take at most `most_segments` together and the error is above
  // `enough_px`. The long-segment tile is always among them. O(parts log parts).
  LevelChoice choose(const LevelView& view, std::uint64_t most_segments, double enough_px = 0.5) const;

 private:
  struct Impl;
  explicit Levels(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Compares every level tile with the full-resolution tiles below it: that all of their owned segments are accounted
// for, and that at most those said to be dropped lie farther from the level's threads of the same cell than the error
// that it states. Returns one line for each problem. O(segments * levels * threads of a cell in a tile).
std::vector<std::string> checkLevels(const TileSet& set, const Levels& levels);

}  // namespace filiform
