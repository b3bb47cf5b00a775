#include "index/tile/leaf_index.h"

#include <algorithm>
#include <utility>

namespace filiform {

LeafIndex::LeafIndex(std::vector<BlockKey> leaves) {
  const auto size = static_cast<TileId>(leaves.size());
  if (size == 0) return;
  const MortonKey low = leaves.front().low;
  *this = LeafIndex({low}, {.page_leaves = size, .group_pages = 1, .leaves = size});
  addGroup(0, {low});
  add(0, std::move(leaves));
}

LeafIndex::LeafIndex(std::vector<MortonKey> group_lows, const Shape& shape)
    : lows_(std::move(group_lows)), groups_(std::make_unique<Group[]>(lows_.size())), shape_(shape) {}

std::size_t LeafIndex::groupOf(MortonKey key) const noexcept {
  const auto after = std::upper_bound(lows_.begin(), lows_.end(), key);
  return after == lows_.begin() ? kNone : static_cast<std::size_t>(after - lows_.begin()) - 1;
}

std::size_t LeafIndex::pageOf(MortonKey key) const noexcept {
  const std::size_t at = groupOf(key);
  if (at == kNone || !knowsGroup(at)) return kNone;
  const std::vector<MortonKey>& lows = groups_[at].lows;
  const auto after = std::upper_bound(lows.begin(), lows.end(), key);
  return after == lows.begin() ? kNone : firstPage(at) + static_cast<std::size_t>(after - lows.begin()) - 1;
}

bool LeafIndex::knows(std::size_t page) const noexcept {
  const std::size_t group = page / shape_.group_pages;
  return knowsGroup(group) && groups_[group].pages[page % shape_.group_pages].known.load(std::memory_order_acquire);
}

void LeafIndex::addGroup(std::size_t group, std::vector<MortonKey> page_lows) {
  Group& added = groups_[group];
  added.pages = std::make_unique<Page[]>(page_lows.size());
  added.lows = std::move(page_lows);
  added.known.store(true, std::memory_order_release);
}

void LeafIndex::add(std::size_t page, std::vector<BlockKey> leaves) {
  Page& added = groups_[page / shape_.group_pages].pages[page % shape_.group_pages];
  added.leaves = std::move(leaves);
  added.known.store(true, std::memory_order_release);
}

TileId LeafIndex::firstFrom(MortonKey key) const noexcept {
  const std::size_t group = groupOf(key);
  if (group == kNone) return 0;
  if (lows_[group] == key) return static_cast<TileId>(firstPage(group)) * shape_.page_leaves;
  const std::size_t page = pageOf(key);
  if (page == kNone) return kNoTile;
  const std::size_t in_group = page - firstPage(group);
  const TileId first = static_cast<TileId>(page) * shape_.page_leaves;
  if (groups_[group].lows[in_group] == key) return first;
  if (!knows(page)) return kNoTile;
  const std::vector<BlockKey>& leaves = groups_[group].pages[in_group].leaves;
  const auto at = std::lower_bound(leaves.begin(), leaves.end(), key,
                                   [](const BlockKey& leaf, MortonKey k) { return leaf.low < k; });
  return first + static_cast<TileId>(at - leaves.begin());
}

TileId LeafIndex::home(const GridPoint& p) const noexcept {
  const MortonKey key = mortonKey(p);
  const std::size_t page = pageOf(key);
  if (page == kNone || !knows(page)) return kNoTile;
  const std::vector<BlockKey>& leaves = groups_[page / shape_.group_pages].pages[page % shape_.group_pages].leaves;
  auto after = std::upper_bound(leaves.begin(), leaves.end(), key,
                                [](MortonKey k, const BlockKey& leaf) { return k < leaf.low; });
  if (after == leaves.begin()) return kNoTile;
  --after;
  if (!after->contains(key)) return kNoTile;
  return static_cast<TileId>(page) * shape_.page_leaves + static_cast<TileId>(after - leaves.begin());
}

}  // namespace filiform
