#include "index/geometry/morton.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

constexpr std::int64_t kEdge = std::int64_t{1} << 41;

GridPoint randomPoint(std::mt19937_64& random, std::int64_t span) {
  std::uniform_int_distribution<std::int64_t> d(-span, span - 1);
  return {d(random), d(random), d(random)};
}

TEST(Morton, KeyAndPointAreInverse) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    const GridPoint p = randomPoint(random, std::int64_t{1} << (i % 42));
    EXPECT_EQ(mortonPoint(mortonKey(p)), p);
  }
  MortonKeys keys;
  for (int i = 0; i < 2000; ++i) {
    const GridPoint p = randomPoint(random, std::int64_t{1} << (20 + i % 4));
    EXPECT_EQ(keys.of(p), mortonKey(p));
  }
  EXPECT_EQ(MortonKeys().of(GridPoint::Constant(-kEdge)), MortonKey{0});
  EXPECT_EQ(mortonKey(GridPoint::Constant(-kEdge)), MortonKey{0});
  EXPECT_EQ(mortonKey(GridPoint::Constant(kEdge - 1)), (MortonKey{1} << kMortonBits) - 1);
}

TEST(Morton, AxesAlternateFromTheTopBit) {
  const GridPoint origin = GridPoint::Constant(-kEdge);
  for (int axis = 0; axis < 3; ++axis)
    for (int bit = 0; bit < kMortonAxisBits; ++bit) {
      GridPoint p = origin;
      p[axis] += std::int64_t{1} << bit;
      EXPECT_EQ(mortonKey(p), MortonKey{1} << (3 * bit + 2 - axis));
    }
}

TEST(BlockKey, HalvesDivideTheBoxAlongOneAxis) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 200; ++i) {
    BlockKey block;
    const MortonKey inside = mortonKey(randomPoint(random, kEdge));
    for (int depth = 0; depth < kMortonBits; ++depth) {
      const BlockKey low = block.half(0), high = block.half(1);
      const GridBox box = block.box(), a = low.box(), b = high.box();
      const int axis = depth % 3;
      ASSERT_EQ(a.lo, box.lo);
      ASSERT_EQ(b.hi, box.hi);
      ASSERT_EQ(a.hi[axis] + 1, b.lo[axis]);
      for (int other = 0; other < 3; ++other)
        if (other != axis) {
          ASSERT_EQ(a.hi[other], box.hi[other]);
        }
      ASSERT_NE(low.contains(inside), high.contains(inside));
      block = low.contains(inside) ? low : high;
    }
    EXPECT_EQ(block.low, inside);
    EXPECT_EQ(block.high(), inside);
  }
}

// Brute force: clips the segment's parameter interval against every slab, in exact rational arithmetic.
bool meetsByClipping(const GridPoint& a, const GridPoint& b, const GridBox& box) {
  __extension__ using Wide = __int128;
  Wide n0 = 0, d0 = 1, n1 = 1, d1 = 1;  // [n0/d0, n1/d1]
  for (int i = 0; i < 3; ++i) {
    const Wide d = b[i] - a[i];
    if (d == 0) {
      if (a[i] < box.lo[i] || a[i] > box.hi[i]) return false;
      continue;
    }
    Wide from = d > 0 ? box.lo[i] - a[i] : a[i] - box.hi[i];
    Wide to = d > 0 ? box.hi[i] - a[i] : a[i] - box.lo[i];
    const Wide length = d > 0 ? d : -d;
    if (from * d0 > n0 * length) n0 = from, d0 = length;
    if (to * d1 < n1 * length) n1 = to, d1 = length;
  }
  return n0 * d1 <= n1 * d0;
}

TEST(SegmentMeetsBox, AgreesWithExactClipping) {
  for (std::int64_t span : {std::int64_t{4}, std::int64_t{100}, std::int64_t{1} << 20, std::int64_t{1} << 40}) {
    SCOPED_TRACE(span);
    std::mt19937_64 random(span);
    int met = 0;
    for (int i = 0; i < 20000; ++i) {
      const GridPoint a = randomPoint(random, span), b = randomPoint(random, span);
      GridBox box;
      box.extend(randomPoint(random, span));
      box.extend(randomPoint(random, span));
      const bool meets = segmentMeetsBox(a, b, box);
      ASSERT_EQ(meets, meetsByClipping(a, b, box)) << a.transpose() << " - " << b.transpose();
      ASSERT_EQ(meets, segmentMeetsBox(b, a, box));
      met += meets;
    }
    EXPECT_GT(met, 1000);
    EXPECT_LT(met, 19000);
  }
}

TEST(SegmentMeetsBox, TouchingCounts) {
  const GridBox box{{0, 0, 0}, {2, 2, 2}};
  EXPECT_TRUE(segmentMeetsBox({2, 2, 2}, {3, 3, 3}, box));
  EXPECT_TRUE(segmentMeetsBox({1, 3, 1}, {3, 1, 1}, box));   // through the edge (2, 2)
  EXPECT_FALSE(segmentMeetsBox({1, 4, 1}, {4, 1, 1}, box));  // past it
  EXPECT_TRUE(segmentMeetsBox({1, 1, 1}, {1, 1, 1}, box));
  EXPECT_FALSE(segmentMeetsBox({3, 1, 1}, {3, 1, 1}, box));
  EXPECT_FALSE(segmentMeetsBox({0, 0, 0}, {2, 2, 2}, GridBox{}));
}

}  // namespace
}  // namespace filiform
