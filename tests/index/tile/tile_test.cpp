#include "index/tile/tile.h"

#include "tests/support/scenes/test_graph.h"

#include <algorithm>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

StoredSegment segment(std::uint32_t cell, std::uint32_t child, std::uint32_t parent, const GridPoint& a,
                      const GridPoint& b, bool owned = true) {
  return {{cell, child}, child, parent, a, b, owned};
}

using Segments = std::vector<StoredSegment>;
const BlockKey kWorld{};

TEST(Tile, SortsSegmentsAndNodesByTheirIds) {
  const GridPoint p0(0, 0, 0), p1(1, 0, 0), p2(2, 0, 0), p3(1, 5, 0), q(9, 9, 9);
  const Tile tile(4, kWorld, false, Grid(),
                  Segments{segment(1, 0, 0, q, q), segment(0, 3, 1, p3, p1, false), segment(0, 1, 0, p1, p0),
                           segment(0, 2, 1, p2, p1)});
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
  const Tile tile(0, kWorld, false, Grid(), Segments{segment(0, 1, 0, p, p)});
  EXPECT_EQ(tile.node_count(), 2u);
  EXPECT_FALSE(tile.isolated(0));
}

TEST(Tile, SegmentsMayBeNamedOtherwiseThanTheirChildren) {  // graphs
  const GridPoint p0(0, 0, 0), p1(1, 0, 0), p2(2, 0, 0);
  const Tile tile(0, kWorld, false, Grid(),
                  Segments{{{0, 0}, 2, 1, p2, p1, true}, {{0, 1}, 1, 0, p1, p0, true}, {{0, 2}, 0, 2, p0, p2, true}});
  EXPECT_EQ(tile.node_count(), 3u);
  for (std::uint32_t n = 0; n < 3; ++n) EXPECT_EQ(tile.incident(n).size(), 2u);
  EXPECT_EQ(tile.gridPoint(tile.child(0)), p2);
  EXPECT_EQ(tile.gridPoint(tile.parent(2)), p2);
}

TEST(Tile, NodesInsideANeuriteLieBetweenTheirNeighbours) {
  std::vector<StoredSegment> segments;
  for (std::uint32_t i = 1; i < 100; ++i)
    segments.push_back(segment(0, i, i == 60 ? 30 : i - 1, GridPoint(i, 0, 0), GridPoint(i == 60 ? 30 : i - 1, 0, 0)));
  const Tile tile(0, kWorld, false, Grid(), segments);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const bool is_tip_or_fork = i == 0 || i == 30 || i == 59 || i == 99, begins_strip = i == 60;
    EXPECT_EQ(tile.isBetween(*tile.findNode({0, i})), !is_tip_or_fork && !begins_strip) << i;
  }
}

TEST(Tile, WideTilesKeepExactPositions) {
  const std::int64_t far = std::int64_t{1} << 40;
  const GridPoint a(-far, far, 7), b(far, -far, 8);
  const Tile wide(0, kWorld, true, Grid(), Segments{segment(0, 1, 0, a, b)});
  EXPECT_EQ(wide.gridPoint(1), a);
  EXPECT_EQ(wide.gridPoint(0), b);
  EXPECT_EQ(wide.position_W(1), Grid().toWorld(a));
  const GridPoint c = b + GridPoint(UINT32_MAX, 0, 0), d = b + GridPoint(std::int64_t{UINT32_MAX} + 1, 0, 0);
  const Tile narrow(0, kWorld, true, Grid(), Segments{segment(0, 1, 0, c, b)});
  const Tile too_wide(0, kWorld, true, Grid(), Segments{segment(0, 1, 0, d, b)});
  EXPECT_EQ(narrow.gridPoint(1), c);
  EXPECT_EQ(too_wide.gridPoint(1), d);
  EXPECT_LT(narrow.bytes(), too_wide.bytes());
}

// Each layout of positions at its limit: 16, 21 and 32 bits.
TEST(Tile, PositionsAreExactAtEveryWidth) {
  const GridPoint b(-1000, 2000, 0);
  for (const std::int64_t extent : {std::int64_t{0xffff}, std::int64_t{0x10000}, std::int64_t{0x1fffff},
                                    std::int64_t{0x200000}, std::int64_t{UINT32_MAX}, std::int64_t{UINT32_MAX} + 1}) {
    const GridPoint a = b + GridPoint(1, extent, extent / 2);
    const Tile tile(0, kWorld, false, Grid(), Segments{segment(0, 1, 0, a, b)});
    EXPECT_EQ(tile.gridPoint(tile.child(0)), a);
    EXPECT_EQ(tile.gridPoint(tile.parent(0)), b);
    EXPECT_EQ(tile.position_W(tile.child(0)), Grid().toWorld(a));
    EXPECT_EQ(tile.position_W(tile.parent(0)), Grid().toWorld(b));
    Tile::Offset lo, hi;
    tile.bound(tile.runs()[0], lo, hi);
    EXPECT_EQ(lo, (Tile::Offset{0, 0, 0}));
    EXPECT_EQ(hi, (Tile::Offset{1, static_cast<std::uint64_t>(extent), static_cast<std::uint64_t>(extent / 2)}));
  }
}

void expectLink(const Tile& tile, std::uint32_t segment, const Tile::Link& link) {
  EXPECT_EQ(link.id, tile.segmentId(segment));
  EXPECT_EQ(link.child, tile.child(segment));
  EXPECT_EQ(link.parent, tile.parent(segment));
  EXPECT_EQ(link.child_id, tile.nodeId(link.child));
  EXPECT_EQ(link.parent_id, tile.nodeId(link.parent));
}

// Compares with plain tables of the given segments.
void expectHolds(const Tile& tile, std::vector<StoredSegment> segments) {
  std::sort(segments.begin(), segments.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  ASSERT_EQ(tile.segment_count(), segments.size());
  std::map<NodeId, std::pair<GridPoint, std::vector<std::uint32_t>>> nodes;
  for (std::uint32_t s = 0; s < segments.size(); ++s) {
    const StoredSegment& expected = segments[s];
    const NodeId child{expected.id.cell, expected.child_sample}, parent{expected.id.cell, expected.parent_sample};
    EXPECT_EQ(tile.segmentId(s), expected.id);
    EXPECT_EQ(tile.findSegment(expected.id), s);
    EXPECT_EQ(tile.nodeId(tile.child(s)), child);
    EXPECT_EQ(tile.nodeId(tile.parent(s)), parent);
    EXPECT_EQ(tile.owned(s), expected.owned);
    EXPECT_EQ(tile.isolated(s), child == parent);
    expectLink(tile, s, tile.link(s));
    nodes[child].first = expected.child;
    nodes[parent].first = expected.parent;
    nodes[child].second.push_back(s);
    if (child != parent) nodes[parent].second.push_back(s);
  }
  ASSERT_EQ(tile.node_count(), nodes.size());
  for (const auto& [id, node] : nodes) {
    const std::optional<std::uint32_t> found = tile.findNode(id);
    ASSERT_TRUE(found);
    EXPECT_EQ(tile.gridPoint(*found), node.first);
    const Tile::Incident incident = tile.incident(*found);
    EXPECT_EQ(std::vector<std::uint32_t>(incident.begin(), incident.end()), node.second);
    std::vector<std::uint32_t> visited;
    const auto visit = [&](std::uint32_t s, const Tile::Link& link) {
      visited.push_back(s);
      expectLink(tile, s, link);
    };
    EXPECT_EQ(tile.visitIncident(*found, UINT32_MAX, visit), node.second.size());
    EXPECT_EQ(visited, node.second);
    visited.clear();
    EXPECT_EQ(tile.visitIncident(*found, 2, visit), node.second.size());
    EXPECT_EQ(visited.size(), node.second.size() <= 2 ? node.second.size() : 0);
    for (const NodeId other : {NodeId{id.cell, id.sample + 1}, NodeId{id.cell + 1, id.sample}})
      EXPECT_EQ(tile.findNode(other).has_value(), nodes.contains(other));
    if (!tile.isBetween(*found)) continue;
    ASSERT_EQ(incident.size(), 2u);
    const Tile::Link to_parent = tile.link(incident[0]), to_child = tile.link(incident[1]);
    EXPECT_EQ((std::pair{to_parent.child, to_parent.parent}), (std::pair{*found, *found - 1}));
    EXPECT_EQ((std::pair{to_child.child, to_child.parent}), (std::pair{*found + 1, *found}));
    EXPECT_EQ(to_child.id.segment, to_parent.id.segment + 1);
    EXPECT_EQ(to_child.child_id.sample, id.sample + 1);
    EXPECT_EQ(to_parent.parent_id.sample, id.sample - 1);
  }
  std::vector<int> met(segments.size(), 0);
  for (const SegmentRun run : tile.runs())
    for (std::uint32_t i = 0; i < run.count(); ++i) ++met.at(run.begin() + i);
  EXPECT_EQ(std::count(met.begin(), met.end(), 1), static_cast<std::ptrdiff_t>(met.size()));
}

TEST(Tile, HoldsRandomGraphs) {
  std::mt19937_64 random(6);
  SCOPED_TRACE("seed 6");
  for (int round = 0; round < 60; ++round) {
    test::TestGraph graph = test::randomGraph(random, 5 + 5 * round, round % 3 != 0);
    for (StoredSegment& s : graph.segments) s.owned = random() % 2 != 0;
    std::shuffle(graph.segments.begin(), graph.segments.end(), random);
    expectHolds(Tile(0, kWorld, false, graph.grid, graph.segments), graph.segments);
    // A part of the segments: some parents have no segment of their own.
    graph.segments.resize(graph.segments.size() / 2);
    expectHolds(Tile(0, kWorld, false, graph.grid, graph.segments), graph.segments);
  }
}

TEST(Tile, JoinedTilesHoldTheSegmentsOfBoth) {
  std::mt19937_64 random(7);
  SCOPED_TRACE("seed 7");
  for (int round = 0; round < 60; ++round) {
    std::vector<StoredSegment> parts[2], both;
    for (int part = 0; part < 2; ++part) {
      test::TestGraph graph = test::randomGraph(random, 5 + 3 * round, (round >> part) % 3 != 0);
      const GridPoint shift(0, (part == 0 ? 1 : -1) * (std::int64_t{1} << (round % 40)), 0);
      std::shuffle(graph.segments.begin(), graph.segments.end(), random);
      if (round % 4 == 0) graph.segments.resize(graph.segments.size() / 2 + 1);
      for (StoredSegment& s : graph.segments) {
        s.owned = random() % 2 != 0;
        s.id.cell += static_cast<std::uint32_t>(100 * part);
        s.child += shift;
        s.parent += shift;
      }
      parts[part] = graph.segments;
      both.insert(both.end(), graph.segments.begin(), graph.segments.end());
    }
    const Tile joined(Tile(0, kWorld, false, Grid(), parts[0]), Tile(0, kWorld, false, Grid(), parts[1]));
    const Tile built(0, kWorld, false, Grid(), both);
    expectHolds(joined, both);
    EXPECT_EQ(joined.bytes(), built.bytes());
    EXPECT_EQ(joined.origin(), built.origin());
    EXPECT_EQ(joined.offset_bits(), built.offset_bits());
    for (std::uint32_t node = 0; node < built.node_count(); ++node) EXPECT_EQ(joined.isHome(node), built.isHome(node));
  }
}

TEST(Tile, HoldsANodeWithManyBranches) {
  std::vector<StoredSegment> segments;
  for (std::uint32_t i = 1; i <= 2000; ++i) segments.push_back(segment(0, 2 * i, 1001, {i, 1, 1}, {5, 5, 5}));
  segments.push_back(segment(0, 1001, 7001, {5, 5, 5}, {0, 0, 0}));
  expectHolds(Tile(0, kWorld, false, Grid(), segments), segments);
}

TEST(Tile, HomeIsWhereTheBlockContainsTheNode) {
  BlockKey block;  // x < 0
  block = block.half(0);
  const Tile tile(0, block, false, Grid(), Segments{segment(0, 1, 0, {-1, 0, 0}, {0, 0, 0})});
  EXPECT_FALSE(tile.isHome(0));
  EXPECT_TRUE(tile.isHome(1));
  const Tile long_tile(0, kWorld, true, Grid(), Segments{segment(0, 1, 0, {-1, 0, 0}, {0, 0, 0})});
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
