// Levels of detail of a tile set, for drawing: inner blocks of the partition with simplified neurites.
// Each level tile states its error. Haptics always use full resolution.
//
//   const auto levels = Levels::open(*set);
//   const LevelChoice choice = levels->choose(view, 2'000'000);
//   for (const LevelPart& part : choice.parts)
//     const auto tile = part.level ? levels->load(part.tile) : set->load(part.tile);
//
// Of a full-resolution tile, draw only the segments that it owns.
#pragma once

#include "index/levels/level_parts.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace filiform {

// Thread rule: internally synchronised. below(), above() and choose() may read the set's directory.
class Levels {
 public:
  // Opens the levels of `set`, which must outlive this object. Returns nullptr if the set has no levels. Reads the
  // table of level tiles. Throws CorruptSet, IoError. O(level tiles).
  static std::unique_ptr<Levels> open(const TileSet& set);
  ~Levels();

  LevelId size() const;
  const LevelEntry& entry(LevelId level) const;
  std::uint64_t bytes() const;  // of all level files on disk

  // load: reads one level tile, on its own grid. Its nodes are numbered along the neurites, anew in each tile: they are
  // not samples of the file. Cells are those of the set. The tile owns every segment; no node is at home there.
  // loadAppearance: its types and radii. Both throw CorruptTile (with the level's id) and IoError.
  std::shared_ptr<const Tile> load(LevelId level) const;
  TileAppearance loadAppearance(LevelId level) const;

  // The level tiles and full-resolution tiles directly below a level tile; for kRoots: the topmost ones. The first call
  // for a level reads the directory's pages of these tiles. Throws CorruptSet, IoError. O(parts), then O(1).
  std::span<const LevelPart> below(LevelId level) const;
  bool knowsBelow(LevelId level) const;  // true if below() would read nothing
  // The level tile directly above a part; kRoots: none. Reads the page of a full-resolution tile, unless below() has.
  // Throws as below() does. O(log level tiles).
  LevelId above(const LevelPart& part) const;
  static constexpr LevelId kRoots = kLevelRoots;

  // The error of a level tile on the screen, in pixels: of its segments, or the size of the pixels that hide others.
  // Never 0, so that `enough_px` = 0 asks for full resolution. Infinite if the eye is inside the tile's box, the
  // view is not orthographic and `nearest_um` is 0.
  double errorOnScreen(LevelId level, const LevelView& view) const;

  // Chooses tiles that together show each place in the view once. Starts with the coarsest tile. While the segments
  // stay within `most_segments` and the error exceeds `enough_px`, replaces all tiles of about the largest error
  // (within a tenth) by the tiles below them. If these are too many, replaces single tiles, that of the largest error
  // first, each that fits; first of all those around the eye. The coarsest tile and the long-segment tile are always
  // included. Throws as below() does if it reads. O(parts log parts).
  LevelChoice choose(const LevelView& view, std::uint64_t most_segments, double enough_px = kEnough_px,
                     UnreadTiles unread = UnreadTiles::read) const;
  static constexpr double kEnough_px = 1;

 private:
  struct Impl;
  explicit Levels(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Compares every level tile with the full-resolution tiles below it. All owned segments must be counted, and each cell
// must have a segment or ball in the tile or beside it (in the tiles directly below the same tile; of the outermost
// block in all that are as fine), unless the tile is `coarser`. Each full-resolution segment must lie within the stated
// error of the tile's neurites of its cell. If it does not, segments of the tile or beside it must cover its pixels.
// Each segment of the tile must lie within the error of its cell. Returns one line a problem. O(segments * levels).
std::vector<std::string> checkLevels(const TileSet& set, const Levels& levels);

}  // namespace filiform
