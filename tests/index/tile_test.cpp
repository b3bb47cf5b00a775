#include "index/tile.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

StoredSegment segment(std::uint32_t cell, std::uint32_t child, std::uint32_t parent, const GridPoint& a,
                      const GridPoint& b, bool owned = true) {
  return {{cell, child}, child, parent, a, b, owned};
}

const CellKey kWorld{};

TEST(Tile, SortsSegmentsAndNodesByTheirIds) {
  const GridPoint p0(0, 0, 0), p1(1, 0, 0), p2(2, 0, 0), p3(1, 5, 0), q(9, 9, 9);
  const Tile tile(
      4, kWorld, false, Grid(),
      {segment(1, 0, 0, q, q), segment(0, 3, 1, p3, p1, false), segment(0, 1, 0, p1, p0), segment(0, 2, 1, p2, p1)});
  EXPECT_EQ(tile.id(), 4u);
  ASSERT_EQ(tile.node_count(), 5u);
  ASSERT_EQ(tile.segment_count(), 4u);
  EXPECT_EQ(tile.owned_count(), 3u);
  EXPECT_EQ(tile.segmentId(0), (SegmentId{0, 1}));
  EXPECT_EQ(tile.segmentId(3), (SegmentId{1, 0}));
  EXPECT_TRUE(tile.isolated(3));
  EXPECT_FALSE(tile.owned(2));
  const std::uint32_t node = *tile.findNode({0, 1});
  EXPECT_EQ(tile.gridPoint(node), p1);
  EXPECT_EQ(std::vector<std::uint32_t>(tile.incident(node).begin(), tile.incident(node).end()),
            (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(tile.incident(*tile.findNode({1, 0})).size(), 1u) << "an isolated segment is listed once";
  EXPECT_FALSE(tile.findNode({2, 0}));
  EXPECT_FALSE(tile.findNode({0, 4}));
  EXPECT_FALSE(tile.findSegment({0, 0}));
  EXPECT_EQ(tile.findSegment({0, 3}), 2u);
}

TEST(Tile, ZeroLengthSegmentIsNotIsolated) {
  const GridPoint p(3, 3, 3);
  const Tile tile(0, kWorld, false, Grid(), {segment(0, 1, 0, p, p)});
  EXPECT_EQ(tile.node_count(), 2u);
  EXPECT_FALSE(tile.isolated(0));
}

TEST(Tile, SegmentsMayBeNamedOtherwiseThanTheirChildren) {  // graphs
  const GridPoint p0(0, 0, 0), p1(1, 0, 0), p2(2, 0, 0);
  const Tile tile(0, kWorld, false, Grid(),
                  {{{0, 0}, 2, 1, p2, p1, true}, {{0, 1}, 1, 0, p1, p0, true}, {{0, 2}, 0, 2, p0, p2, true}});
  EXPECT_EQ(tile.node_count(), 3u);
  for (std::uint32_t n = 0; n < 3; ++n) EXPECT_EQ(tile.incident(n).size(), 2u);
  EXPECT_EQ(tile.gridPoint(tile.child(0)), p2);
  EXPECT_EQ(tile.gridPoint(tile.parent(2)), p2);
}

TEST(Tile, WideTilesKeepExactPositions) {
  const std::int64_t far = std::int64_t{1} << 40;
  const GridPoint a(-far, far, 7), b(far, -far, 8);
  const Tile wide(0, kWorld, true, Grid(), {segment(0, 1, 0, a, b)});
  EXPECT_EQ(wide.gridPoint(1), a);
  EXPECT_EQ(wide.gridPoint(0), b);
  EXPECT_EQ(wide.position_W(1), Grid().toWorld(a));
  const GridPoint c = b + GridPoint(INT32_MAX, 0, 0), d = b + GridPoint(std::int64_t{INT32_MAX} + 1, 0, 0);
  const Tile narrow(0, kWorld, true, Grid(), {segment(0, 1, 0, c, b)});
  const Tile too_wide(0, kWorld, true, Grid(), {segment(0, 1, 0, d, b)});
  EXPECT_EQ(narrow.gridPoint(1), c);
  EXPECT_EQ(too_wide.gridPoint(1), d);
  EXPECT_LT(narrow.bytes(), too_wide.bytes());
}

TEST(Tile, HomeIsWhereTheCellContainsTheNode) {
  CellKey cell;  // x < 0
  cell = cell.half(0);
  const Tile tile(0, cell, false, Grid(), {segment(0, 1, 0, {-1, 0, 0}, {0, 0, 0})});
  EXPECT_FALSE(tile.isHome(0));
  EXPECT_TRUE(tile.isHome(1));
  const Tile long_tile(0, kWorld, true, Grid(), {segment(0, 1, 0, {-1, 0, 0}, {0, 0, 0})});
  EXPECT_FALSE(long_tile.isHome(0));
}

TEST(Tile, ContentDoesNotDependOnTheOrderOfSegments) {
  std::mt19937_64 random(5);
  std::vector<StoredSegment> segments;
  std::vector<GridPoint> at;
  for (int i = 0; i < 200; ++i) at.push_back(GridPoint(random() % 100, random() % 100, random() % 100));
  for (std::uint32_t i = 1; i < 200; ++i) {
    const auto parent = static_cast<std::uint32_t>(random() % 3 ? i - 1 : random() % i);
    segments.push_back(segment(i % 2, i, parent, at[i], at[parent], random() % 2));
  }
  const Tile sorted(0, kWorld, false, Grid(), segments);
  std::shuffle(segments.begin(), segments.end(), random);
  const Tile shuffled(0, kWorld, false, Grid(), segments);
  ASSERT_EQ(sorted.node_count(), shuffled.node_count());
  ASSERT_EQ(sorted.segment_count(), shuffled.segment_count());
  EXPECT_EQ(sorted.bytes(), shuffled.bytes());
  std::size_t ends = 0;
  for (std::uint32_t n = 0; n < sorted.node_count(); ++n) {
    EXPECT_EQ(sorted.nodeId(n), shuffled.nodeId(n));
    EXPECT_EQ(sorted.gridPoint(n), shuffled.gridPoint(n));
    const auto a = sorted.incident(n), b = shuffled.incident(n);
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
    EXPECT_TRUE(std::is_sorted(a.begin(), a.end()));
    for (std::uint32_t s : a) EXPECT_TRUE(sorted.child(s) == n || sorted.parent(s) == n);
    ends += a.size();
  }
  EXPECT_EQ(ends, 2 * segments.size());
}

TEST(Tile, EmptyTileHasNothing) {
  const Tile tile(0, kWorld, false, Grid(), {});
  EXPECT_EQ(tile.node_count(), 0u);
  EXPECT_EQ(tile.segment_count(), 0u);
  EXPECT_FALSE(tile.findNode({0, 0}));
  EXPECT_FALSE(tile.findSegment({0, 0}));
}

}  // namespace
}  // namespace filiform
