#include "index/tile/internal/simplify.h"

#include "index/build/memory_tiles.h"
#include "tests/support/random_cells.h"
#include "tests/support/sanitized.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace filiform {
namespace {

double distance(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d way = b - a;
  const double squared = way.squaredNorm();
  const double t = squared > 0 ? std::clamp((p - a).dot(way) / squared, 0.0, 1.0) : 0.0;
  return (p - a - t * way).norm();
}

// The largest distance, cell by cell, from points on the segments of one graph to the segments of the other.
double farthest(const NeuriteGraph& from, const NeuriteGraph& to, const Grid& grid) {
  std::map<std::uint32_t, std::vector<const NeuriteSegment*>> by_cell;
  for (const NeuriteSegment& s : to.segments) by_cell[to.nodes[s.child].id.cell].push_back(&s);
  double worst = 0;
  for (const NeuriteSegment& s : from.segments) {
    const Vector3d a = grid.toWorld(from.nodes[s.child].p), b = grid.toWorld(from.nodes[s.parent].p);
    const auto& others = by_cell[from.nodes[s.child].id.cell];
    if (others.empty()) return std::numeric_limits<double>::infinity();
    for (const double t : {0.0, 0.3, 0.5, 0.8, 1.0}) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const NeuriteSegment* o : others)
        nearest = std::min(nearest, distance(a + t * (b - a), grid.toWorld(to.nodes[o->child].p),
                                             grid.toWorld(to.nodes[o->parent].p)));
      worst = std::max(worst, nearest);
    }
  }
  return worst;
}

struct Shape {
  std::size_t pieces = 0;  // number of connected pieces of nodes with a segment
  std::set<NodeId> tips, branchings;
  bool operator==(const Shape&) const = default;
};

Shape shapeOf(const NeuriteGraph& graph) {
  std::vector<std::uint32_t> root(graph.nodes.size()), degree(graph.nodes.size(), 0);
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::uint32_t n) {
    while (root[n] != n) n = root[n] = root[root[n]];
    return n;
  };
  std::set<std::uint32_t> with_segments;
  for (const NeuriteSegment& s : graph.segments) {
    root[find(s.child)] = find(s.parent);
    with_segments.insert({s.child, s.parent});
    if (s.child != s.parent) ++degree[s.child], ++degree[s.parent];
  }
  Shape shape;
  std::set<std::uint32_t> roots;
  for (const std::uint32_t n : with_segments) {
    roots.insert(find(n));
    if (degree[n] == 1) shape.tips.insert(graph.nodes[n].id);
    if (degree[n] > 2) shape.branchings.insert(graph.nodes[n].id);
  }
  shape.pieces = roots.size();
  return shape;
}

NeuriteGraph wholeOf(const std::vector<Cell>& cells, const Grid& grid) {
  CellList stream(cells);
  const auto store = buildTilesInMemory(stream, {.capacity = 1u << 30});
  if (store->tile_count() == 0) return {};
  return neuritesOf(*store->load(0), store->loadAppearance(0), grid);
}

// The worst case of each kind of cell, and random cells.
std::vector<test::NamedCells> inputs() {
  std::vector<test::NamedCells> all = test::worstCases();
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
    all.push_back({"column " + std::to_string(seed), test::randomColumn(seed, 4, 300, 100)});
  return all;
}

constexpr std::size_t kUnlimited = std::size_t{1} << 40;
const Grid kGrid;

TEST(Simplify, StaysWithinTheErrorThatItStatesInBothDirections) {
  for (const test::NamedCells& input : inputs()) {
    const NeuriteGraph whole = wholeOf(input.cells, kGrid);
    std::size_t before = whole.segments.size();
    if (test::kSanitized && before > 600) continue;  // comparing all with all takes minutes under sanitizers
    for (const double tolerance : {0.01, 0.5, 3.0, 40.0, 1e4}) {
      SCOPED_TRACE(input.name + ", tolerance " + std::to_string(tolerance));
      const NeuriteGraph simple = simplify(whole, kGrid, {tolerance, tolerance, kUnlimited});
      const double error = errorOf(simple);
      EXPECT_LE(error, tolerance);
      const double slack = 1e-6 + 1e-12 * 2e9;  // for the distances here, at 1e9 um
      EXPECT_LE(farthest(whole, simple, kGrid), error + slack);
      EXPECT_LE(farthest(simple, whole, kGrid), error + slack);
      EXPECT_LE(simple.segments.size(), before) << "coarser, but more";
      before = simple.segments.size();
      EXPECT_EQ(simple.dropped, 0u);
    }
  }
}

TEST(Simplify, KeepsPiecesBranchingsAndEnds) {
  for (const test::NamedCells& input : inputs()) {
    SCOPED_TRACE(input.name);
    const NeuriteGraph whole = wholeOf(input.cells, kGrid);
    const Shape shape = shapeOf(whole);
    // A tolerance so small that only twigs of length 0 are removed: all other branch points and tips stay.
    const NeuriteGraph fine = simplify(whole, kGrid, {1e-9, 1e-9, kUnlimited});
    if (input.name != "coincident nodes" && input.name != "zero lengths" && input.name != "one voxel") {
      EXPECT_EQ(shapeOf(fine), shape);
    }
    for (const double tolerance : {0.5, 3.0, 40.0, 1e5}) {
      const Shape simple = shapeOf(simplify(whole, kGrid, {tolerance, tolerance, kUnlimited}));
      EXPECT_EQ(simple.pieces, shape.pieces) << "tolerance " << tolerance;
      EXPECT_TRUE(std::includes(shape.branchings.begin(), shape.branchings.end(), simple.branchings.begin(),
                                simple.branchings.end()));
    }
  }
}

TEST(Simplify, MovesNoNode) {
  const NeuriteGraph whole = wholeOf(test::randomColumn(9, 4, 500, 100), kGrid);
  std::map<NodeId, GridPoint> at;
  for (const NeuriteNode& n : whole.nodes) at.emplace(n.id, n.p);
  const NeuriteGraph simple = simplify(whole, kGrid, {2, 2, kUnlimited});
  EXPECT_LT(simple.segments.size(), whole.segments.size() / 2);
  for (const NeuriteNode& n : simple.nodes) EXPECT_EQ(at.at(n.id), n.p);
}

TEST(Simplify, BudgetMakesTheShortestCellsGo) {
  const NeuriteGraph whole = wholeOf(test::randomColumn(10, 12, 300, 300), kGrid);
  for (const std::size_t most : {2000u, 400u, 100u, 30u, 1u}) {
    const NeuriteGraph simple = simplify(whole, kGrid, {0.1, 0.4, most});
    std::set<std::uint32_t> left;
    std::uint64_t segments = simple.dropped;
    double shortest_um = 1e300, length_um = simple.dropped_um;
    for (const NeuriteSegment& s : simple.segments) left.insert(simple.nodes[s.child].id.cell);
    for (const NeuriteShare& share : simple.shares) {
      EXPECT_TRUE(left.contains(share.cell));
      shortest_um = std::min(shortest_um, share.length_um);
      segments += share.segments;
      length_um += share.length_um;
    }
    for (const NeuriteShare& share : whole.shares) {
      if (!left.contains(share.cell)) {
        EXPECT_LE(share.length_um, shortest_um);
      }
    }
    EXPECT_EQ(left.size(), simple.shares.size());
    EXPECT_GE(left.size(), 1u);
    EXPECT_LE(simple.segments.size(), most);
    EXPECT_EQ(segments, whole.segments.size());
    EXPECT_NEAR(length_um,
                std::accumulate(whole.shares.begin(), whole.shares.end(), 0.0,
                                [](double sum, const NeuriteShare& s) { return sum + s.length_um; }),
                1e-6);
  }
}

TEST(Simplify, BudgetPrefersAHigherTolerance) {
  const NeuriteGraph whole = wholeOf(test::randomColumn(11, 5, 400, 100), kGrid);
  const std::size_t fine = simplify(whole, kGrid, {0.05, 10, kUnlimited}).segments.size();
  const NeuriteGraph simple = simplify(whole, kGrid, {0.05, 10, fine * 2 / 3});
  EXPECT_EQ(simple.dropped, 0u);
  EXPECT_LE(simple.segments.size(), fine * 2 / 3);
  EXPECT_GT(errorOf(simple), 0.05);
  EXPECT_LE(errorOf(simple), 10);
}

// ---- graphs with loops

NeuriteGraph ring(std::uint32_t n, double radius_um, std::uint32_t cell = 0) {
  NeuriteGraph graph;
  for (std::uint32_t i = 0; i < n; ++i) {
    const double angle = 2 * 3.14159265358979 * i / n;
    graph.nodes.push_back({{cell, i}, kGrid.snap(radius_um * Vector3d(std::cos(angle), std::sin(angle), 0)), 2, 2, 0});
    graph.segments.push_back({i, (i + 1) % n, 0, 1.0f, 3});
  }
  graph.shares.push_back({cell, n, 2 * 3.14159265358979 * radius_um});
  return graph;
}

TEST(Simplify, LoopsKeepAnAnchor) {
  const NeuriteGraph loop = ring(200, 50);
  for (const double tolerance : {0.1, 5.0, 60.0, 1e3}) {
    SCOPED_TRACE(tolerance);
    const NeuriteGraph simple = simplify(loop, kGrid, {tolerance, tolerance, kUnlimited});
    ASSERT_FALSE(simple.segments.empty());
    EXPECT_EQ(simple.nodes[0].id, (NodeId{0, 0}));
    EXPECT_LE(errorOf(simple), tolerance);
    EXPECT_LE(farthest(loop, simple, kGrid), errorOf(simple) + 1e-9);
    EXPECT_LE(farthest(simple, loop, kGrid), errorOf(simple) + 1e-9);
    if (tolerance < 50) {
      EXPECT_GE(simple.segments.size(), 2u);
    }
    if (tolerance > 100) {
      EXPECT_EQ(simple.segments.size(), 1u);
    }
    // An isolated node stays isolated.
    const NeuriteGraph again = simplify(simple, kGrid, {tolerance, tolerance, kUnlimited});
    EXPECT_EQ(again.segments.size(), simple.segments.size());
  }
}

TEST(Simplify, LoopsThatHangTogetherDoNotAllDisappear) {
  NeuriteGraph eight = ring(40, 1);
  for (std::uint32_t i = 1; i < 40; ++i) {
    const GridPoint mirrored = eight.nodes[0].p + (eight.nodes[0].p - eight.nodes[i].p);
    eight.nodes.push_back({{0, 39 + i}, mirrored, 2, 2, 0});
    eight.segments.push_back({i == 1 ? 0 : 38 + i, 39 + i, 0, 1.0f, 3});
  }
  eight.segments.push_back({78, 0, 0, 1.0f, 3});
  eight.nodes[0].full = eight.nodes[0].seen = 4;
  for (const double tolerance : {0.01, 1.0, 10.0}) {
    const NeuriteGraph simple = simplify(eight, kGrid, {tolerance, tolerance, kUnlimited});
    EXPECT_EQ(shapeOf(simple).pieces, 1u);
    EXPECT_LE(farthest(eight, simple, kGrid), errorOf(simple) + 1e-9);
  }
}

// ---- several parts joined

TEST(Simplify, PartsThatAreJoinedAreTheWhole) {
  const std::vector<Cell> cells = test::randomColumn(21, 5, 400, 200);
  CellList stream(cells);
  const auto store = buildTilesInMemory(stream, {.capacity = 50});
  std::vector<NeuriteGraph> parts;
  for (TileId tile = 0; tile < store->tile_count(); ++tile)
    parts.push_back(neuritesOf(*store->load(tile), store->loadAppearance(tile), kGrid));
  const NeuriteGraph joined = join(parts), whole = wholeOf(cells, kGrid);
  ASSERT_EQ(joined.segments.size(), whole.segments.size());
  ASSERT_EQ(joined.nodes.size(), whole.nodes.size());
  EXPECT_EQ(shapeOf(joined), shapeOf(whole));
  std::map<NodeId, NeuriteNode> nodes;
  for (const NeuriteNode& n : joined.nodes) nodes.emplace(n.id, n);
  ASSERT_EQ(nodes.size(), joined.nodes.size());
  for (const NeuriteNode& n : whole.nodes) {
    ASSERT_TRUE(nodes.contains(n.id));
    EXPECT_EQ(nodes.at(n.id).p, n.p);
    EXPECT_EQ(nodes.at(n.id).full, n.full);
    EXPECT_EQ(nodes.at(n.id).seen, n.full) << "all of its segments have come";
  }
  ASSERT_EQ(joined.shares.size(), whole.shares.size());
  for (std::size_t i = 0; i < whole.shares.size(); ++i) EXPECT_EQ(joined.shares[i].segments, whole.shares[i].segments);
}

TEST(Simplify, PiecesStayTogetherThroughAllLevels) {
  const std::vector<Cell> cells = test::randomColumn(22, 5, 400, 200);
  const NeuriteGraph whole = wholeOf(cells, kGrid);
  CellList stream(cells);
  const auto store = buildTilesInMemory(stream, {.capacity = 50});
  std::vector<NeuriteGraph> parts;
  for (TileId tile = 0; tile < store->tile_count(); ++tile)
    parts.push_back(neuritesOf(*store->load(tile), store->loadAppearance(tile), kGrid));
  double tolerance = 0.2;
  for (; parts.size() > 1; tolerance *= 2) {
    std::vector<NeuriteGraph> next;
    for (std::size_t i = 0; i < parts.size(); i += 8) {
      std::vector<NeuriteGraph> group(parts.begin() + static_cast<std::ptrdiff_t>(i),
                                      parts.begin() + static_cast<std::ptrdiff_t>(std::min(parts.size(), i + 8)));
      next.push_back(simplify(join(std::move(group)), kGrid, {tolerance, tolerance, kUnlimited}));
    }
    parts = std::move(next);
  }
  EXPECT_EQ(shapeOf(parts[0]).pieces, shapeOf(whole).pieces);
  EXPECT_LE(farthest(whole, parts[0], kGrid), errorOf(parts[0]) + 1e-6);
  EXPECT_LE(farthest(parts[0], whole, kGrid), errorOf(parts[0]) + 1e-6);
  EXPECT_LE(errorOf(parts[0]), 2 * tolerance);
}

// ---- converted to a tile

TEST(Simplify, NumberedSegmentsAreThoseOfTheGraph) {
  std::vector<test::NamedCells> all = inputs();
  for (const test::NamedCells& input : all) {
    SCOPED_TRACE(input.name);
    const NeuriteGraph graph = simplify(wholeOf(input.cells, kGrid), kGrid, {1, 1, kUnlimited});
    TileAppearance appearance;
    const std::vector<StoredSegment> stored = numbered(graph, appearance);
    ASSERT_EQ(stored.size(), graph.segments.size());
    ASSERT_EQ(appearance.radii_um.size(), stored.size());
    std::multiset<std::vector<std::int64_t>> expected, got;
    const auto key = [](std::uint32_t cell, const GridPoint& a, const GridPoint& b, std::uint16_t type) {
      return std::vector<std::int64_t>{cell, a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), type};
    };
    for (const NeuriteSegment& s : graph.segments)
      expected.insert(key(graph.nodes[s.child].id.cell, graph.nodes[s.child].p, graph.nodes[s.parent].p, s.type));
    for (std::size_t i = 0; i < stored.size(); ++i) {
      EXPECT_EQ(stored[i].id.segment, stored[i].child_sample);
      if (i > 0) {
        EXPECT_LT(stored[i - 1].id, stored[i].id);
      }
      got.insert(key(stored[i].id.cell, stored[i].child, stored[i].parent, appearance.types[i]));
    }
    EXPECT_EQ(got, expected);
    if (stored.empty()) continue;
    const Tile tile(0, BlockKey{}, true, kGrid, stored);
    EXPECT_EQ(tile.segment_count(), stored.size());
  }
  TileAppearance appearance;
  const NeuriteGraph loop = ring(10, 50);
  const std::vector<StoredSegment> stored = numbered(loop, appearance);
  EXPECT_EQ(stored.size(), 10u);
  std::set<std::uint32_t> children;
  for (const StoredSegment& s : stored) EXPECT_TRUE(children.insert(s.child_sample).second);
}

}  // namespace
}  // namespace filiform
