// Which tile is home to a point: the sorted keys of all leaves. Immutable; safe on the haptic thread.
#pragma once

#include "index/tile.h"

#include <vector>

namespace filiform {

class LeafIndex {
 public:
  LeafIndex() = default;
  // Requires disjoint cells in ascending order of `low`. Tile ids are positions in `leaves`.
  explicit LeafIndex(std::vector<CellKey> leaves) : leaves_(std::move(leaves)) {}

  std::size_t size() const { return leaves_.size(); }
  const CellKey& key(TileId tile) const { return leaves_[tile]; }
  // The tile whose cell contains the point, or kNoTile where space is empty. O(log tiles).
  TileId home(const GridPoint& p) const noexcept;

 private:
  std::vector<CellKey> leaves_;
};

}  // namespace filiform
