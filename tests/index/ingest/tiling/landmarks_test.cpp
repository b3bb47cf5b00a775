#include "index/ingest/tiling/landmarks.h"

#include "index/geometry/closest_point.h"
#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/tile_invariants.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Segments = std::vector<StoredSegment>;

Landmarks choose(const std::vector<Cell>& cells, std::size_t most, std::uint32_t capacity = 64) {
  CellList stream(cells);
  return chooseLandmarks(*buildTilesInMemory(stream, {.capacity = capacity}), most);
}

double nearestLandmark(const Landmarks& landmarks, const Grid& grid, const Vector3d& p_W) {
  double least = INFINITY;
  for (const GridPoint& p : landmarks.points) least = std::min(least, (grid.toWorld(p) - p_W).squaredNorm());
  return std::sqrt(least);
}

// Compares with brute force: dense points of every segment. Returns the largest distance found.
double expectCovered(const Landmarks& landmarks, const Segments& segments, const Grid& grid, int dense) {
  double largest = 0;
  for (const StoredSegment& s : segments) {
    const Vector3d a = grid.toWorld(s.child), b = grid.toWorld(s.parent);
    for (int k = 0; k <= dense; ++k)
      largest = std::max(largest, nearestLandmark(landmarks, grid, a + k * (b - a) / dense));
  }
  EXPECT_LE(largest, landmarks.covering_radius_um);
  return largest;
}

void expectOnSegments(const Landmarks& landmarks, const Segments& segments, const Grid& grid) {
  ASSERT_EQ(landmarks.points.size(), landmarks.segments.size());
  ASSERT_EQ(landmarks.points.size(), landmarks.t.size());
  for (std::size_t i = 0; i < landmarks.points.size(); ++i) {
    const auto found = std::lower_bound(segments.begin(), segments.end(), landmarks.segments[i],
                                        [](const StoredSegment& s, SegmentId id) { return s.id < id; });
    ASSERT_TRUE(found != segments.end() && found->id == landmarks.segments[i]);
    const Vector3d p_W = grid.toWorld(landmarks.points[i]);
    const ClosestPoint c = closestPoint(grid.toWorld(found->child), grid.toWorld(found->parent), p_W);
    ASSERT_LE(std::sqrt(c.squared_distance), grid.quantum_um());
    ASSERT_TRUE(landmarks.t[i] > 0.0f && landmarks.t[i] < 1.0f);
    const Vector3d along =
        grid.toWorld(found->child) + static_cast<double>(landmarks.t[i]) * grid.toWorld(found->parent - found->child);
    ASSERT_LE((along - p_W).norm(), grid.quantum_um() + 1e-7 * grid.toWorld(found->parent - found->child).norm());
    if (i > 0) {
      ASSERT_LT(mortonKey(landmarks.points[i - 1]), mortonKey(landmarks.points[i]));
    }
  }
}

TEST(Landmarks, CoverEveryPointOfTheData) {
  const Grid grid;
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(41, 6, 200, 150)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const Segments segments = test::snappedSegments(named.cells, grid);
    for (std::size_t most : {std::size_t{1}, std::size_t{7}, std::size_t{150}}) {
      const Landmarks landmarks = choose(named.cells, most);
      EXPECT_LE(landmarks.points.size(), most);
      EXPECT_EQ(landmarks.points.empty(), segments.empty());
      expectOnSegments(landmarks, segments, grid);
      expectCovered(landmarks, segments, grid, 6);
    }
  }
}

TEST(Landmarks, TheRadiusIsNotMuchLargerThanItMustBe) {
  const Grid grid;
  const std::vector<Cell> cells = test::randomColumn(42, 4, 400, 200);
  const Landmarks landmarks = choose(cells, 100);
  EXPECT_GT(landmarks.points.size(), 40u);
  EXPECT_LE(landmarks.covering_radius_um, 1.8 * expectCovered(landmarks, test::snappedSegments(cells, grid), grid, 6));
}

TEST(Landmarks, OneLongSegmentDoesNotSpoilTheRadius) {
  std::vector<Cell> cells = test::randomColumn(43, 4, 400, 200);
  const double without = choose(cells, 1000).covering_radius_um;
  test::addSample(cells[0], cells[0].positions_um[0] + Vector3d(700, 0, 0), 0);
  const Landmarks landmarks = choose(cells, 1000);
  EXPECT_LE(landmarks.covering_radius_um, 2 * without);
  EXPECT_GT(std::count_if(landmarks.t.begin(), landmarks.t.end(), [](float t) { return t != 0.5f; }), 10);
  expectCovered(landmarks, test::snappedSegments(cells, Grid()), Grid(), 12);
}

TEST(Landmarks, MorePointsCoverBetter) {
  const std::vector<Cell> cells = test::randomColumn(44, 6, 500, 200);
  double before = INFINITY;
  for (std::size_t most = 8; most <= 4096; most *= 8) {
    const double radius_um = choose(cells, most).covering_radius_um;
    EXPECT_LT(radius_um, 0.9 * before) << most;
    before = radius_um;
  }
}

// The radius depends on the tiles: if several leaves lie in one block, their boxes replace their segments.
TEST(Landmarks, PointsDoNotDependOnTheTiles) {
  const std::vector<Cell> cells = test::randomColumn(45, 4, 300, 100);
  const Landmarks one = choose(cells, 200, 100000);
  for (std::uint32_t capacity : {3u, 10u, 1000u}) {
    const Landmarks again = choose(cells, 200, capacity);
    EXPECT_EQ(again.points, one.points);
    EXPECT_EQ(again.segments, one.segments);
    EXPECT_EQ(again.t, one.t);
    EXPECT_GE(again.covering_radius_um, 0.999 * one.covering_radius_um);
    EXPECT_LE(again.covering_radius_um, 2 * one.covering_radius_um);
    expectCovered(again, test::snappedSegments(cells, Grid()), Grid(), 6);
  }
}

TEST(Landmarks, SmallSetsGetFew) {
  EXPECT_EQ(landmarksFor(0), 64u);
  EXPECT_EQ(landmarksFor(128 * 1000), 1000u);
  EXPECT_EQ(landmarksFor(UINT64_MAX), kMaxLandmarks);
}

}  // namespace
}  // namespace filiform
