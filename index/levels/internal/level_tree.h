// LevelTree: what lies directly below each level tile, and above it. The directory's pages of full-resolution tiles are
// read when these tiles are first asked for. Thread rule: internally synchronised.
#pragma once

#include "index/file/internal/read_once.h"
#include "index/levels/level_parts.h"
#include "index/set/tile_set.h"

#include <span>
#include <vector>

namespace filiform::internal {

class LevelTree {
 public:
  // Set and entries must outlive it; the entries are in the order of levels.bin. Reads nothing. O(entries).
  LevelTree(const TileSet& set, const std::vector<LevelEntry>& entries);

  // As Levels says. below(), knowsBelow() and above() throw std::out_of_range if the level does not exist.
  std::span<const LevelPart> below(LevelId level) const;
  bool knowsBelow(LevelId level) const;
  LevelId above(const LevelPart& part) const;

  // What is known of a level without reading: the level tiles directly below, and the segments of the other tiles
  // there.
  std::span<const LevelPart> levelsBelow(LevelId level) const { return below_[placeOf(level)]; }
  std::uint32_t segmentsOfLeaves(LevelId level) const;  // at most UINT32_MAX
  // A box of all content below, for a level tile.
  const GridBox& box(LevelId level) const { return boxes_[level]; }

 private:
  using KeyRange = std::pair<MortonKey, MortonKey>;  // first and last
  std::size_t placeOf(LevelId level) const;          // in the vectors with an element for the roots
  std::vector<KeyRange> leavesBelow(std::size_t place) const;
  std::vector<LevelPart> read(std::size_t place) const;

  const TileSet& set_;
  const std::vector<LevelEntry>& entries_;
  std::vector<LevelId> above_;                 // by LevelId; kRoots for the topmost
  std::vector<std::vector<LevelPart>> below_;  // level tiles, by LevelId, then the topmost
  std::vector<GridBox> boxes_;
  mutable std::vector<ReadOnce<std::vector<LevelPart>>> known_;  // with the full-resolution tiles
};

}  // namespace filiform::internal
