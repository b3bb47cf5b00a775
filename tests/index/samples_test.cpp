#include "index/samples.h"

#include "index/closest_point.h"
#include "index/memory_tiles.h"
#include "tests/support/random_cells.h"
#include "tests/support/tile_invariants.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::vector<SegmentEnds> endsOf(const std::vector<Cell>& cells, const Grid& grid) {
  std::vector<SegmentEnds> ends;
  for (const StoredSegment& s : test::snappedSegments(cells, grid)) ends.push_back({s.id, s.child, s.parent});
  return ends;
}

double nearestSample(const SamplePoints& samples, const Grid& grid, const Vector3d& p_W) {
  double least = INFINITY;
  for (const GridPoint& p : samples.points) least = std::min(least, (grid.toWorld(p) - p_W).squaredNorm());
  return std::sqrt(least);
}

// Against brute force: dense points of every segment. Returns the largest distance found.
double expectCovered(const SamplePoints& samples, const std::vector<SegmentEnds>& segments, const Grid& grid,
                     int dense) {
  double largest = 0;
  for (const SegmentEnds& s : segments) {
    const Vector3d a = grid.toWorld(s.child), b = grid.toWorld(s.parent);
    for (int k = 0; k <= dense; ++k) largest = std::max(largest, nearestSample(samples, grid, a + k * (b - a) / dense));
  }
  EXPECT_LE(largest, samples.covering_radius_um);
  return largest;
}

void expectOnSegments(const SamplePoints& samples, const std::vector<SegmentEnds>& segments, const Grid& grid) {
  ASSERT_EQ(samples.points.size(), samples.segments.size());
  ASSERT_EQ(samples.points.size(), samples.t.size());
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const auto found = std::lower_bound(segments.begin(), segments.end(), samples.segments[i],
                                        [](const SegmentEnds& s, SegmentId id) { return s.id < id; });
    ASSERT_TRUE(found != segments.end() && found->id == samples.segments[i]);
    const Vector3d p_W = grid.toWorld(samples.points[i]);
    const ClosestPoint c = closestPoint(grid.toWorld(found->child), grid.toWorld(found->parent), p_W);
    ASSERT_LE(std::sqrt(c.squared_distance), grid.quantum_um());
    if (samples.t[i] == 0.0f || samples.t[i] == 1.0f) {
      ASSERT_EQ(samples.points[i], samples.t[i] == 0.0f ? found->child : found->parent);
      for (const SegmentEnds& s : segments) {  // no lower one has an end there
        if (s.id == found->id) break;
        ASSERT_TRUE(s.child != samples.points[i] && s.parent != samples.points[i]);
      }
    }
    if (i > 0) {
      ASSERT_LT(mortonKey(samples.points[i - 1]), mortonKey(samples.points[i]));
    }
  }
}

TEST(Samples, CoverEveryPointOfTheData) {
  const Grid grid;
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(41, 6, 200, 150)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const std::vector<SegmentEnds> segments = endsOf(named.cells, grid);
    for (std::size_t most : {std::size_t{1}, std::size_t{7}, std::size_t{150}}) {
      const SamplePoints samples = chooseSamples(segments, grid, most);
      EXPECT_LE(samples.points.size(), most);
      EXPECT_EQ(samples.points.empty(), segments.empty());
      expectOnSegments(samples, segments, grid);
      expectCovered(samples, segments, grid, 6);
    }
  }
}

TEST(Samples, TheRadiusIsNotMuchLargerThanItMustBe) {
  const Grid grid;
  const std::vector<SegmentEnds> segments = endsOf(test::randomColumn(42, 4, 400, 200), grid);
  const SamplePoints samples = chooseSamples(segments, grid, 100);
  EXPECT_LE(samples.covering_radius_um, 1.3 * expectCovered(samples, segments, grid, 6));
}

TEST(Samples, OneLongSegmentDoesNotSpoilTheRadius) {
  const Grid grid;
  std::vector<Cell> cells = test::randomColumn(43, 4, 400, 200);
  const double without = chooseSamples(endsOf(cells, grid), grid, 1000).covering_radius_um;
  test::addSample(cells[0], cells[0].positions_um[0] + Vector3d(700, 0, 0), 0);
  const std::vector<SegmentEnds> segments = endsOf(cells, grid);
  const SamplePoints samples = chooseSamples(segments, grid, 1000);
  EXPECT_LE(samples.covering_radius_um, 1.5 * without);
  EXPECT_TRUE(std::any_of(samples.t.begin(), samples.t.end(), [](float t) { return t > 0.0f && t < 1.0f; }));
  expectCovered(samples, segments, grid, 12);
}

TEST(Samples, MorePointsNeverCoverMuchWorse) {
  const Grid grid;
  const std::vector<SegmentEnds> segments = endsOf(test::randomColumn(44, 6, 500, 200), grid);
  double before = INFINITY;
  for (std::size_t most = 10; most <= 10240; most *= 4) {
    const double radius_um = chooseSamples(segments, grid, most).covering_radius_um;
    EXPECT_LT(radius_um, 0.9 * before) << most;
    before = radius_um;
  }
}

TEST(Samples, ArePurelyAFunctionOfTheSegments) {
  const std::vector<Cell> cells = test::randomColumn(45, 4, 300, 100);
  const Grid grid;
  const SamplePoints direct = chooseSamples(endsOf(cells, grid), grid, 500);
  for (std::uint32_t capacity : {10u, 1000u}) {
    test::VectorCellStream stream(cells);
    const auto store = buildTilesInMemory(stream, {.capacity = capacity});
    const SamplePoints again = chooseSamples(*store, 500);
    EXPECT_EQ(again.points, direct.points);
    EXPECT_EQ(again.segments, direct.segments);
    EXPECT_EQ(again.t, direct.t);
    EXPECT_EQ(again.covering_radius_um, direct.covering_radius_um);
  }
}

}  // namespace
}  // namespace filiform
