#include "index/tile/leaf_index.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// Leaves of one grid point each, with keys 0, 3, 6 ...
std::vector<BlockKey> leavesWithEveryThirdKey(TileId count) {
  std::vector<BlockKey> leaves;
  for (TileId i = 0; i < count; ++i) leaves.push_back({MortonKey{3} * i, kMortonBits});
  return leaves;
}

TEST(LeafIndex, FirstFromNeedsNoPageThatBeginsAtTheKey) {
  const std::vector<BlockKey> leaves = leavesWithEveryThirdKey(20);
  const LeafIndex::Shape shape{.page_leaves = 3, .group_pages = 2, .leaves = 20};
  std::vector<MortonKey> groups;
  for (std::size_t i = 0; i < leaves.size(); i += 6) groups.push_back(leaves[i].low);
  for (MortonKey key = 0; key < 62; ++key) {
    LeafIndex index(groups, shape);
    const std::size_t group = index.groupOf(key);
    std::vector<MortonKey> lows;
    for (std::size_t i = 6 * group; i < std::min<std::size_t>(6 * group + 6, 20); i += 3) lows.push_back(leaves[i].low);
    if (leaves[6 * group].low != key) {
      index.addGroup(group, lows);
      const std::size_t page = index.pageOf(key);
      const auto begin = leaves.begin() + static_cast<std::ptrdiff_t>(3 * page);
      if (begin->low != key) index.add(page, {begin, std::min(begin + 3, leaves.end())});
    }
    const auto expected = std::lower_bound(leaves.begin(), leaves.end(), key,
                                           [](const BlockKey& leaf, MortonKey k) { return leaf.low < k; });
    EXPECT_EQ(index.firstFrom(key), static_cast<TileId>(expected - leaves.begin()));
  }
}

TEST(LeafIndex, FirstFromAKeyBeforeAllIsTheFirst) {
  const LeafIndex index(std::vector<BlockKey>{{MortonKey{8}, kMortonBits}, {MortonKey{9}, kMortonBits}});
  EXPECT_EQ(index.firstFrom(0), 0u);
  EXPECT_EQ(index.firstFrom(8), 0u);
  EXPECT_EQ(index.firstFrom(9), 1u);
  EXPECT_EQ(index.firstFrom(10), 2u);
}

}  // namespace
}  // namespace filiform
