// Paths along cells: against relaxation over all links until nothing changes.
#include "index/query/cell_paths.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;
using RankList = std::vector<std::uint32_t>;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

CellPaths pathsOf(const Cell& cell) { return CellPaths(readCell(*storeOf({cell}, 7), 0, false)); }

// 0 - 1 - 2 with a fork at 2: 3 - 4 upwards, 20 um more; 5 downwards, 5 um more. 6 is isolated.
Cell forkedCell() {
  Cell cell;
  cell.source = "fork.swc";
  cell.sample_ids = {10, 11, 12, 13, 14, 15, 16};
  cell.positions_um = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}, {20, 10, 0}, {20, 20, 0}, {20, -5, 0}, {90, 0, 0}};
  cell.parents = {kNoParent, 0, 1, 2, 3, 2, kNoParent};
  cell.radii_um.assign(7, 1);
  cell.types = {1, 3, 3, 3, 3, 3, 3};
  return cell;
}

// Random links between random samples: loops, links that are there twice, isolated samples, several trees.
Cell randomGraph(std::uint64_t seed, std::uint32_t samples, std::uint32_t links) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, 50);
  Cell cell;
  cell.source = "graph";
  for (std::uint32_t i = 0; i < samples; ++i)
    test::addSample(cell, random() % 9 == 0 && i > 0 ? cell.positions_um.back()
                                                     : Vector3d(place(random), place(random), place(random)));
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (std::uint32_t i = 0; i < links; ++i) {
    const auto a = static_cast<std::uint32_t>(random() % samples), b = static_cast<std::uint32_t>(random() % samples);
    if (a != b) edges.push_back({a, b});
  }
  connect(cell, edges);
  return cell;
}

struct Link {
  std::uint32_t segment, child, parent;
};
std::vector<Link> linksOf(const Cell& cell) {
  std::vector<Link> links;
  for (std::uint32_t rank = 0; rank < cell.segmentRanks(); ++rank)
    if (const auto [child, parent] = cell.ends(rank); child != parent) links.push_back({rank, child, parent});
  return links;
}

// The lengths from a place to all samples.
std::vector<double> bruteForceLengths(const Cell& cell, const CellGraph& graph, const CellPlace& from) {
  const auto apart_um = [&](std::uint32_t a, std::uint32_t b) {
    return (graph.position_W(a) - graph.position_W(b)).norm();
  };
  std::vector<double> lengths(cell.samples(), kInfinite);
  lengths[from.child] = from.t * apart_um(from.child, from.parent);
  lengths[from.parent] = std::min(lengths[from.parent], (1 - from.t) * apart_um(from.child, from.parent));
  std::vector<Link> links = linksOf(cell);
  for (bool changed = true; changed; std::reverse(links.begin(), links.end())) {  // both ways: fewer rounds
    changed = false;
    for (const Link& link : links) {
      const double length = apart_um(link.child, link.parent);
      double &child = lengths[link.child], &parent = lengths[link.parent];
      if (parent + length < child) child = parent + length, changed = true;
      if (child + length < parent) parent = child + length, changed = true;
    }
  }
  return lengths;
}

double bruteForceLength(const Cell& cell, const CellGraph& graph, const CellPlace& from, const CellPlace& to) {
  const std::vector<double> lengths = bruteForceLengths(cell, graph, from);
  const double segment_um = (graph.position_W(to.child) - graph.position_W(to.parent)).norm();
  double best = std::min(lengths[to.child] + to.t * segment_um, lengths[to.parent] + (1 - to.t) * segment_um);
  if (from.segment == to.segment) best = std::min(best, std::abs(from.t - to.t) * segment_um);
  return best;
}

// Two neighbours on a path are joined by a segment of the cell, and the lengths add up.
void expectPathAlongTheCell(const CellPaths& paths, const CellPath& path, const CellPlace& from, const CellPlace& to) {
  ASSERT_FALSE(path.points.empty());
  EXPECT_EQ(path.points.front().p_W, paths.position_W(from));
  EXPECT_EQ(path.points.back().p_W, paths.position_W(to));
  EXPECT_EQ(path.points.front().along_um, 0);
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    const CellPath::Point& point = path.points[i];
    const bool is_end = i == 0 || i + 1 == path.points.size();
    EXPECT_TRUE(point.sample || is_end) << i;
    if (point.sample) {
      EXPECT_EQ(point.p_W, paths.graph().position_W(*point.sample));
    }
    if (i == 0) continue;
    const CellPath::Point& before = path.points[i - 1];
    EXPECT_NEAR(point.along_um - before.along_um, (point.p_W - before.p_W).norm(), 1e-9);
    EXPECT_GE(point.along_um, before.along_um);
    if (!point.sample || !before.sample) continue;
    EXPECT_NE(point.sample, before.sample);
    const RankList here = paths.segmentsAt(*point.sample), there = paths.segmentsAt(*before.sample);
    EXPECT_TRUE(std::any_of(here.begin(), here.end(), [&](std::uint32_t segment) {
      return std::find(there.begin(), there.end(), segment) != there.end();
    })) << i;
  }
}

CellPlace randomPlace(const CellPaths& paths, const std::vector<Link>& links, std::mt19937_64& random) {
  if (links.empty() || random() % 3 == 0) return paths.at(static_cast<std::uint32_t>(random() % paths.samples()));
  const Link& link = links[random() % links.size()];
  const std::optional<CellPlace> place = paths.on(link.segment, static_cast<double>(random() % 9) / 8);
  EXPECT_TRUE(place);
  EXPECT_TRUE(place->child == link.child && place->parent == link.parent);
  return *place;
}

void compare(const Cell& cell, std::uint64_t seed, int times) {
  const CellPaths paths = pathsOf(cell);
  const std::vector<Link> links = linksOf(cell);
  std::mt19937_64 random(seed);
  for (int i = 0; i < times; ++i) {
    const CellPlace from = randomPlace(paths, links, random), to = randomPlace(paths, links, random);
    const double expected = bruteForceLength(cell, paths.graph(), from, to);
    const auto path = paths.path(from, to);
    ASSERT_EQ(path.has_value(), expected < kInfinite);
    ASSERT_EQ(paths.length_um(from, to).has_value(), path.has_value());
    const std::vector<double> lengths = paths.lengths_um(from);
    const std::vector<double> expected_lengths = bruteForceLengths(cell, paths.graph(), from);
    double farthest = 0;
    for (std::uint32_t sample = 0; sample < paths.samples(); ++sample) {
      ASSERT_EQ(lengths[sample] < kInfinite, expected_lengths[sample] < kInfinite);
      if (!(lengths[sample] < kInfinite)) continue;
      ASSERT_NEAR(lengths[sample], expected_lengths[sample], 1e-12 * expected_lengths[sample]);
      if (paths.isTip(sample)) farthest = std::max(farthest, lengths[sample]);
    }
    const std::optional<std::uint32_t> tip = paths.farthestTip(from);
    ASSERT_EQ(tip.has_value(), farthest > 0);
    if (tip) {
      EXPECT_EQ(*paths.length_um(from, paths.at(*tip)), farthest);
    }
    if (!path) continue;
    ASSERT_NEAR(path->length_um(), expected, 1e-12 * expected);
    EXPECT_EQ(*paths.length_um(from, to), path->length_um());
    ASSERT_NO_FATAL_FAILURE(expectPathAlongTheCell(paths, *path, from, to));
    EXPECT_NEAR(*paths.length_um(to, from), path->length_um(), 1e-12 * expected);
    ASSERT_FALSE(::testing::Test::HasFailure()) << i;
  }
}

TEST(CellPaths, InAForestThePathIsThatOfBruteForce) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    test::NeuronShape shape;
    shape.samples = 120;
    shape.branching = 0.2;
    shape.extra_root = 0.02;
    shape.shuffled_files = seed % 2 == 1;
    SCOPED_TRACE(seed);
    compare(test::randomNeuron(seed, shape), seed, 60);
  }
}

TEST(CellPaths, WithLoopsThePathIsThatOfBruteForce) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    compare(randomGraph(seed, 40, seed % 3 == 0 ? 30 : seed % 3 == 1 ? 45 : 120), seed, 60);
  }
}

TEST(CellPaths, InExtremeCellsThePathIsThatOfBruteForce) {
  for (const test::NamedCells& named : test::worstCases())
    for (const Cell& cell : named.cells) {
      SCOPED_TRACE(named.name);
      if (cell.samples() > 0) compare(cell, 5, 4);
    }
}

TEST(CellPaths, LengthsGoAlongTheCell) {
  const CellPaths paths = pathsOf(forkedCell());
  EXPECT_EQ(*paths.length_um(paths.at(4), paths.at(5)), 25);
  EXPECT_EQ(*paths.length_um(*paths.on(3, 0.25), *paths.on(1, 0.5)), 7.5 + 10 + 5);
  EXPECT_EQ(*paths.length_um(*paths.on(3, 0.25), *paths.on(3, 0.75)), 5);
  EXPECT_EQ(paths.length_um(paths.at(0), paths.at(6)), std::nullopt);
  EXPECT_EQ(*paths.length_um(paths.at(6), paths.at(6)), 0);
}

TEST(CellPaths, APathHasThePlacesAndTheSamplesBetween) {
  const CellPaths paths = pathsOf(forkedCell());
  const auto samples = [&](const CellPlace& from, const CellPlace& to) {
    std::vector<int> ranks;
    const auto path = paths.path(from, to);
    EXPECT_TRUE(path);
    for (const CellPath::Point& point : path->points)
      ranks.push_back(point.sample ? static_cast<int>(*point.sample) : -1);
    return ranks;
  };
  using Expected = std::vector<int>;
  EXPECT_EQ(samples(paths.at(0), paths.at(5)), (Expected{0, 1, 2, 5}));
  EXPECT_EQ(samples(paths.at(5), paths.at(0)), (Expected{5, 2, 1, 0}));
  EXPECT_EQ(samples(*paths.on(5, 0.5), *paths.on(1, 0.5)), (Expected{-1, 2, 1, -1}));
  EXPECT_EQ(samples(*paths.on(5, 0.5), *paths.on(5, 0.25)), (Expected{-1, -1}));
  EXPECT_EQ(samples(*paths.on(5, 0.5), *paths.on(5, 0.5)), (Expected{-1}));
  EXPECT_EQ(samples(*paths.on(5, 0.5), paths.at(2)), (Expected{-1, 2}));
  EXPECT_EQ(samples(paths.at(2), *paths.on(3, 1)), (Expected{2})) << "one sample, named by two segments";
  EXPECT_EQ(samples(paths.at(6), paths.at(6)), (Expected{6}));
  EXPECT_FALSE(paths.path(paths.at(0), paths.at(6)));
}

TEST(CellPaths, APlaceIsOnASegmentThatExists) {
  const CellPaths paths = pathsOf(forkedCell());
  EXPECT_FALSE(paths.on(0, 0.5)) << "a root";
  EXPECT_TRUE(paths.on(6, 0.5)) << "isolated";
  EXPECT_FALSE(paths.on(7, 0));
  EXPECT_FALSE(paths.on(1, -0.1));
  EXPECT_FALSE(paths.on(1, 1.1));
  EXPECT_FALSE(paths.on(1, std::nan("")));
  EXPECT_EQ(paths.segmentsAt(2), (RankList{2, 3, 5}));
  for (std::uint32_t sample = 0; sample < paths.samples(); ++sample) {
    const CellPlace place = paths.at(sample);
    EXPECT_EQ(paths.position_W(place), paths.graph().position_W(sample));
    EXPECT_TRUE(paths.on(place.segment, place.t)) << sample;
  }
}

TEST(CellPaths, TipsComeNearestFirstAndOfOneTreeOnly) {
  const CellPaths paths = pathsOf(forkedCell());
  EXPECT_EQ(paths.tips(paths.at(2), 9), (RankList{5, 0, 4}));  // 0 and 4 are both 20 um away
  EXPECT_EQ(paths.tips(paths.at(2), 1), (RankList{5}));
  EXPECT_EQ(paths.tips(paths.at(5), 9), (RankList{0, 4}));  // not itself
  EXPECT_EQ(paths.farthestTip(paths.at(0)), 4u);
  EXPECT_EQ(paths.farthestTip(paths.at(2)), 0u) << "of equally far tips the lowest";
  EXPECT_TRUE(paths.tips(paths.at(6), 9).empty());
  EXPECT_EQ(paths.farthestTip(paths.at(6)), std::nullopt);
}

TEST(CellPaths, RoundALoopTheShorterWayCounts) {
  Cell ring;
  ring.source = "ring";
  for (const Vector3d& p_W : {Vector3d(0, 0, 0), Vector3d(10, 0, 0), Vector3d(10, 10, 0), Vector3d(0, 10, 0)})
    test::addSample(ring, p_W);
  connect(ring, {{0, 1}, {1, 2}, {2, 3}, {3, 0}});
  const CellPaths paths = pathsOf(ring);
  for (std::uint32_t sample = 1; sample < 4; ++sample)
    EXPECT_EQ(*paths.length_um(paths.at(0), paths.at(sample)), sample == 2 ? 20 : 10);
  EXPECT_EQ(paths.farthestTip(paths.at(0)), std::nullopt) << "a ring has no tip";
}

}  // namespace
}  // namespace filiform
