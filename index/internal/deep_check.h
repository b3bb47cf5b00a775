// What the tiles of a set say together, checked tile by tile: the memory is a few hundred bytes a tile and a cell and
// half a byte a sample, whatever the size of the tiles.
//
// Everything that has to agree across tiles is summed, as hashes modulo 2^64, by what should be (from the owners) and
// by what is, and compared at the end: where the sums differ, so do the sets of what was summed. A difference passes
// unseen with a chance of 2^-64; bytes changed on purpose are the checksums' affair.
//
//   DeepCheck check(set, problem);
//   for each tile: check.midpoints(tile);   then begin(), then for each tile: check.tile(tile, appearance);   finish()
#pragma once

#include "index/partition.h"
#include "index/tile_set.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

namespace filiform::internal {

// Thread-compatible.
class DeepCheck {
 public:
  DeepCheck(const TileSet& set, std::function<void(const std::string&)> problem);
  ~DeepCheck();

  // First pass, every tile in order of ids: where the leaves must lie. O(segments).
  void midpoints(const Tile& tile);
  // Between the passes. O(tiles log tiles). False when the cells of the tiles are not leaves: nothing else can then be
  // checked.
  bool begin();
  // Second pass, every tile in order of ids. O(segments * (1 + leaves met)).
  void tile(const Tile& tile, const TileAppearance& appearance);
  // Reads the detail of every cell. Throws CorruptSet, IoError.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
