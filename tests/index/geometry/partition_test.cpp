#include "index/geometry/partition.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::vector<MortonKey> randomKeys(std::uint64_t seed, std::size_t n, std::int64_t span) {
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::int64_t> place(-span, span);
  std::vector<MortonKey> keys;
  for (std::size_t i = 0; i < n; ++i) keys.push_back(mortonKey({place(random), place(random), place(random)}));
  std::sort(keys.begin(), keys.end());
  return keys;
}

TEST(Partition, LeavesCoverTheWorldAndHoldAtMostTheirCapacity) {
  for (std::int64_t span : {std::int64_t{1}, std::int64_t{50}, std::int64_t{1} << 40}) {
    const std::vector<MortonKey> keys = randomKeys(7, 3000, span);
    const Partition partition = Partition::split(keys, 10);
    MortonKey next = 0;
    for (std::uint32_t i = 0; i < partition.leaves().size(); ++i) {
      const BlockKey& leaf = partition.leaves()[i];
      ASSERT_EQ(leaf.low, next);
      next = leaf.high() + 1;
      const auto first = std::lower_bound(keys.begin(), keys.end(), leaf.low);
      const auto last = std::upper_bound(keys.begin(), keys.end(), leaf.high());
      if (last - first > 10) {
        ASSERT_EQ(*first, *(last - 1)) << "could have been split";
      }
      if (leaf.depth > 0) {
        BlockKey whole = leaf;  // the parent would exceed the capacity
        whole.depth--;
        whole.low &= ~((MortonKey{1} << (kMortonBits - whole.depth)) - 1);
        const auto all = std::upper_bound(keys.begin(), keys.end(), whole.high()) -
                         std::lower_bound(keys.begin(), keys.end(), whole.low);
        ASSERT_GT(all, 10);
      }
      for (auto key = first; key != last; ++key) ASSERT_EQ(partition.home(mortonPoint(*key)), i);
    }
    EXPECT_EQ(next, MortonKey{1} << kMortonBits);
  }
}

TEST(Partition, EqualMidpointsStopTheSplitting) {
  const std::vector<MortonKey> keys(5000, mortonKey({3, 4, 5}));
  EXPECT_EQ(Partition::split(keys, 10).leaves().size(), 1u);
  EXPECT_EQ(Partition::split({}, 1).leaves().size(), 1u);
}

TEST(Partition, NeighboursOnTheGridAreToldApart) {
  std::vector<MortonKey> keys(50, mortonKey({-1, 0, 0}));
  keys.resize(100, mortonKey({0, 0, 0}));
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(Partition::split(keys, 10).leaves().size(), 2u);
  keys[0] = mortonKey({-1, 0, 1});
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(Partition::split(keys, 49).leaves().back().low,
            mortonKey(GridPoint(0, -(std::int64_t{1} << 41), -(std::int64_t{1} << 41))));
}

TEST(Partition, IsRebuiltFromItsLeaves) {
  const Partition partition = Partition::split(randomKeys(8, 2000, 100000), 16);
  const Partition again(partition.leaves());
  EXPECT_EQ(again.leaves(), partition.leaves());
  std::mt19937_64 random(9);
  std::uniform_int_distribution<std::int64_t> place(-110000, 110000);
  for (int i = 0; i < 500; ++i) {
    const GridPoint p(place(random), place(random), place(random));
    EXPECT_EQ(again.home(p), partition.home(p));
  }
}

TEST(Partition, LeavesMetAgreesWithBruteForce) {
  for (std::int64_t span : {std::int64_t{6}, std::int64_t{1000}, std::int64_t{1} << 40}) {
    SCOPED_TRACE(span);
    const Partition partition = Partition::split(randomKeys(10, 400, span), 4);
    std::mt19937_64 random(11);
    std::uniform_int_distribution<std::int64_t> place(-span, span);
    std::vector<std::uint32_t> met;
    int many = 0, some = 0, parts = 0;
    for (int i = 0; i < 1500; ++i) {
      const GridPoint a(place(random), place(random), place(random));
      GridPoint b(place(random), place(random), place(random));
      if (i % 2 == 0) b = a + (b - a) / 16;
      if (i % 10 == 0) b = a;
      std::vector<std::uint32_t> expected;
      for (std::uint32_t leaf = 0; leaf < partition.leaves().size(); ++leaf)
        if (segmentMeetsBox(a, b, closedBlock(partition.leaves()[leaf]))) expected.push_back(leaf);
      ASSERT_EQ(partition.leavesMet(a, b, met), expected.size() <= kMaxLeavesOfSegment);
      if (expected.size() > kMaxLeavesOfSegment) {
        ++many;
        continue;
      }
      ++some;
      ASSERT_EQ(met, expected);
      ASSERT_TRUE(std::count(met.begin(), met.end(), partition.home(a)));
      ASSERT_TRUE(std::count(met.begin(), met.end(), partition.home(midpoint(a, b))));
      for (const Partition::Subtree& from : partition.path(partition.leaves()[partition.home(a)])) {
        if (!from.block.containsInside(a) || !from.block.containsInside(b)) continue;
        ++parts;
        ASSERT_TRUE(partition.leavesMet(from, a, b, met));
        ASSERT_EQ(met, expected);
      }
    }
    EXPECT_GT(some, 300);
    EXPECT_GT(parts, some);
    (void)many;
  }
}

TEST(Partition, MidpointDoesNotDependOnTheDirection) {
  EXPECT_EQ(midpoint({0, -1, -2}, {1, 0, -5}), GridPoint(0, -1, -4));
  EXPECT_EQ(midpoint({1, 0, -5}, {0, -1, -2}), GridPoint(0, -1, -4));
}

}  // namespace
}  // namespace filiform
