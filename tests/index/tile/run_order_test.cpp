#include "index/tile/internal/run_order.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

std::vector<GridPoint> randomCentres(std::mt19937_64& random, std::size_t n, std::int64_t extent) {
  std::vector<GridPoint> centres;
  for (std::size_t i = 0; i < n; ++i) {
    const auto coordinate = [&] { return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(extent)); };
    centres.emplace_back(coordinate() - extent / 3, coordinate(), coordinate() / 2);
  }
  return centres;
}

// Splits as orderRuns() says, by sorting.
void splitBySorting(std::vector<std::uint32_t> items, std::size_t group, const std::vector<GridPoint>& centres,
                    std::vector<std::uint32_t>& order) {
  while (group > kTreeWidth && items.size() <= group / kTreeWidth) group /= kTreeWidth;
  if (items.size() <= kTreeWidth) {
    std::sort(items.begin(), items.end());
    order.insert(order.end(), items.begin(), items.end());
    return;
  }
  GridBox box;
  for (const std::uint32_t item : items) box.extend(centres[item]);
  Eigen::Index axis = 0;
  (box.hi - box.lo).maxCoeff(&axis);
  std::sort(items.begin(), items.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(centres[a][axis], a) < std::pair(centres[b][axis], b);
  });
  const std::size_t part = group / kTreeWidth, parts = (items.size() + part - 1) / part;
  const auto middle = items.begin() + static_cast<std::ptrdiff_t>(parts / 2 * part);
  splitBySorting({items.begin(), middle}, group, centres, order);
  splitBySorting({middle, items.end()}, group, centres, order);
}

TEST(RunOrder, NearAndFarCentresAreSplitAsBySorting) {
  std::mt19937_64 random(71);
  for (const std::size_t n : {0u, 1u, 8u, 9u, 64u, 65u, 700u, 3000u})
    for (const std::int64_t extent : {std::int64_t{5}, std::int64_t{1} << 20, std::int64_t{1} << 40}) {
      const std::vector<GridPoint> centres = randomCentres(random, n, extent);
      std::vector<std::uint32_t> items(n), expected;
      for (std::uint32_t i = 0; i < n; ++i) items[i] = i;
      std::size_t group = kTreeWidth;
      while (group < n) group *= kTreeWidth;
      splitBySorting(items, group, centres, expected);
      EXPECT_EQ(orderRuns(centres), expected) << n << " centres within " << extent;
    }
}

}  // namespace
}  // namespace filiform::internal
