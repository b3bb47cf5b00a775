// Checks that the tiles of a set agree with each other, tile by tile. Takes a few hundred bytes a tile and a cell, and
// half a byte a sample, whatever the size of the tiles.
//
// Values that must agree across tiles are summed as hashes modulo 2^64: once as the owners require, once as found. At
// the end the sums are compared. A difference is missed with probability 2^-64. Deliberate changes are left to the
// checksums.
//
//   DeepCheck check(set, problem);
//   for each tile: check.midpoints(tile);   then begin(), then for each tile: check.tile(tile, appearance);   finish()
#pragma once

#include "index/geometry/partition.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible.
class DeepCheck {
 public:
  DeepCheck(const TileSet& set, std::function<void(const std::string&)> problem);
  ~DeepCheck();

  // First pass, every tile in order of ids: determines where the leaves must lie. O(segments).
  void midpoints(const Tile& tile);
  // Call it between the passes. Returns false if the tiles' blocks are not leaves; nothing else can then be checked.
  // O(tiles log tiles).
  bool begin();
  // Second pass, every tile in order of ids: checks the segments. O(segments * (1 + leaves met)).
  void tile(const Tile& tile, const TileAppearance& appearance);
  // Reads the detail of every cell and compares the sums. Throws CorruptSet, IoError.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
