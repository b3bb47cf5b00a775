#include "index/query/curve_order.h"

#include "index/geometry/partition.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(CurveOrder, HasEachPositionOnceByMortonKey) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> um(-500, 500);
  std::vector<Vector3d> points(1000);
  for (Vector3d& p : points) p = Vector3d(um(random), um(random), um(random));
  points[700] = points[3];
  const Grid grid;
  const std::vector<std::size_t> order = curveOrder(grid, points);
  std::vector<std::size_t> positions = order;
  std::sort(positions.begin(), positions.end());
  ASSERT_EQ(positions.size(), points.size());
  for (std::size_t i = 0; i < positions.size(); ++i) ASSERT_EQ(positions[i], i);
  for (std::size_t i = 1; i < order.size(); ++i) {
    const MortonKey before = mortonKey(grid.snap(points[order[i - 1]])), key = mortonKey(grid.snap(points[order[i]]));
    EXPECT_TRUE(before < key || (before == key && order[i - 1] < order[i])) << i;
  }
}

TEST(CurveOrder, TakesPointsBeyondTheGrid) {
  const std::vector<Vector3d> points{{1e100, 1e100, 1e100}, {0, 0, 0}, {-1e100, -1e100, -1e100}};
  EXPECT_EQ(curveOrder(Grid(), points), (std::vector<std::size_t>{2, 1, 0}));
  EXPECT_TRUE(curveOrder(Grid(), {}).empty());
}

}  // namespace
}  // namespace filiform
