#include "index/tile/leaf_index.h"

#include <algorithm>
#include <utility>

namespace filiform {

LeafIndex::LeafIndex(std::vector<BlockKey> leaves) {
  const auto size = static_cast<TileId>(leaves.size());
  if (size == 0) return;
  *this = LeafIndex({leaves.front().low}, size, size);
  add(0, std::move(leaves));
}

LeafIndex::LeafIndex(std::vector<MortonKey> page_lows, TileId page_tiles, TileId size)
    : lows_(std::move(page_lows)),
      pages_(std::make_unique<Page[]>(lows_.size())),
      page_tiles_(page_tiles),
      size_(size) {}

std::size_t LeafIndex::pageOf(const GridPoint& p) const noexcept {
  const auto after = std::upper_bound(lows_.begin(), lows_.end(), mortonKey(p));
  return after == lows_.begin() ? kNoPage : static_cast<std::size_t>(after - lows_.begin()) - 1;
}

void LeafIndex::add(std::size_t page, std::vector<BlockKey> leaves) {
  pages_[page].leaves = std::move(leaves);
  pages_[page].known.store(true, std::memory_order_release);
}

TileId LeafIndex::home(const GridPoint& p) const noexcept {
  const MortonKey key = mortonKey(p);
  const auto page_after = std::upper_bound(lows_.begin(), lows_.end(), key);
  if (page_after == lows_.begin()) return kNoTile;
  const auto page = static_cast<std::size_t>(page_after - lows_.begin()) - 1;
  if (!knows(page)) return kNoTile;
  const std::vector<BlockKey>& leaves = pages_[page].leaves;
  auto after = std::upper_bound(leaves.begin(), leaves.end(), key,
                                [](MortonKey k, const BlockKey& leaf) { return k < leaf.low; });
  if (after == leaves.begin()) return kNoTile;
  --after;
  if (!after->contains(key)) return kNoTile;
  return static_cast<TileId>(page) * page_tiles_ + static_cast<TileId>(after - leaves.begin());
}

}  // namespace filiform
