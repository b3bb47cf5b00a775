#include "index/leaf_index.h"

#include <algorithm>

namespace filiform {

TileId LeafIndex::home(const GridPoint& p) const noexcept {
  const MortonKey key = mortonKey(p);
  auto after = std::upper_bound(leaves_.begin(), leaves_.end(), key,
                                [](MortonKey k, const CellKey& leaf) { return k < leaf.low; });
  if (after == leaves_.begin()) return kNoTile;
  --after;
  return after->contains(key) ? static_cast<TileId>(after - leaves_.begin()) : kNoTile;
}

}  // namespace filiform
