#include "index/query/internal/box_levels.h"

#include "index/tile/box_region.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

std::vector<WorldBox> randomBoxes(std::mt19937_64& random, std::size_t n, double place_um) {
  std::uniform_real_distribution<double> place(-300, 300), size(0, 20);
  std::vector<WorldBox> boxes;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d lo_W = Vector3d::Constant(place_um) + Vector3d(place(random), place(random), place(random));
    boxes.push_back({lo_W, lo_W + (i % 5 == 0 ? Vector3d::Zero() : Vector3d(size(random), 0, size(random)))});
  }
  return boxes;
}

// Items below a place.
void items(const BoxLevels& levels, BoxLevels::Place place, std::vector<std::uint32_t>& all) {
  if (place.level < 0) return all.push_back(place.at);
  for (std::uint32_t i = 0; i < levels.children(place); ++i) items(levels, BoxLevels::child(place, i), all);
}

void expectBounds(const BoxLevels& levels, const std::vector<WorldBox>& boxes, BoxLevels::Place node,
                  const Vector3d& h_W) {
  BoxLevels::Bounds bounds;
  levels.squaredBelow(levels.probe(h_W), node, bounds);
  for (std::uint32_t i = 0; i < BoxLevels::kWidth; ++i) {
    EXPECT_EQ(bounds[i].child(), i);
    if (i >= levels.children(node)) {
      EXPECT_EQ(bounds[i].squared(), HUGE_VALF);
      continue;
    }
    std::vector<std::uint32_t> below;
    items(levels, BoxLevels::child(node, i), below);
    double nearest = HUGE_VAL;
    for (const std::uint32_t item : below) nearest = std::min(nearest, boxes[item].squaredDistanceBelow(h_W));
    ASSERT_LE(double{bounds[i].squared()}, nearest);
    if (node.level == 0 && h_W.cwiseAbs().maxCoeff() < 1e6) {  // and is close to it
      EXPECT_GE(std::sqrt(double{bounds[i].squared()}), std::sqrt(nearest) * (1 - 1e-5) - 1e-3);
    }
    if (node.level > 0) expectBounds(levels, boxes, BoxLevels::child(node, i), h_W);
  }
}

TEST(BoxLevels, BoundsAreAtMostTheDistancesOfTheBoxesBelow) {
  SCOPED_TRACE("seed 5");
  std::mt19937_64 random(5);
  for (const double place_um : {0.0, 1e4, 9e8})
    for (const std::size_t n : {1, 2, 8, 9, 64, 65, 700}) {
      const std::vector<WorldBox> boxes = randomBoxes(random, n, place_um);
      const BoxLevels levels(boxes);
      ASSERT_EQ(levels.items(), n);
      for (const double reach_um : {0.0, 1.0, 100.0, 1e4, 1e9, 1e20, 1e150}) {
        std::normal_distribution<double> jitter(0, reach_um);
        for (int i = 0; i < 5; ++i)
          expectBounds(levels, boxes, levels.root(),
                       boxes[random() % n].hi_W + Vector3d(jitter(random), jitter(random), jitter(random)));
      }
    }
}

TEST(BoxLevels, FindsEveryBoxThatMeetsARegionOnce) {
  SCOPED_TRACE("seed 6");
  std::mt19937_64 random(6);
  for (const double place_um : {0.0, 9e8}) {
    const std::vector<WorldBox> boxes = randomBoxes(random, 1000, place_um);
    const BoxLevels levels(boxes);
    for (const WorldBox& wanted : randomBoxes(random, 50, place_um)) {
      const BoxRegion region({wanted.lo_W, wanted.lo_W + Vector3d::Constant(60)});
      std::vector<std::uint32_t> found;
      levels.meeting(region, [&](std::uint32_t item) { found.push_back(item); });
      std::sort(found.begin(), found.end());
      EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
      for (std::uint32_t i = 0; i < boxes.size(); ++i)
        EXPECT_TRUE(!region.mayMeet(boxes[i]) || std::binary_search(found.begin(), found.end(), i));
    }
  }
}

TEST(BoxLevels, HoldsNothing) {
  const BoxLevels levels({});
  EXPECT_EQ(levels.items(), 0u);
  levels.meeting(BoxRegion({Vector3d::Zero(), Vector3d::Zero()}), [](std::uint32_t) { FAIL(); });
}

}  // namespace
}  // namespace filiform::internal
