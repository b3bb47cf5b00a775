#include "viewer/internal/tour.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(TourWay, LeadsAheadOfTheProxyAndEndsAtItsEnd) {
  Tour tour;
  EXPECT_FALSE(tour.isUnderWay());
  tour.begin({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}});
  EXPECT_LT((tour.aim_W({0, 1, 0}, 4) - Vector3d(4, 0, 0)).norm(), 1e-12);
  EXPECT_LT((tour.aim_W({8, -1, 0}, 4) - Vector3d(10, 2, 0)).norm(), 1e-12);  // about the corner
  EXPECT_LT((tour.aim_W({10, 9, 0}, 4) - Vector3d(10, 10, 0)).norm(), 1e-12);
  EXPECT_TRUE(tour.isUnderWay());
  tour.aim_W({10, 9.8, 0}, 4);
  EXPECT_FALSE(tour.isUnderWay());
}

// A way that crosses itself: the part behind the crossing must not be taken for the one at hand.
TEST(TourWay, IsNotCutShortWhereItCrossesItself) {
  Tour tour;
  tour.begin({{0, 0, 0}, {50, 0, 0}, {50, 50, 0}, {25, 50, 0}, {25, -50, 0}});
  Vector3d p_W = Vector3d::Zero();
  double farthest = 0;
  for (int i = 0; i < 1000 && tour.isUnderWay(); ++i) {
    p_W += 0.5 * (tour.aim_W(p_W, 5) - p_W);
    farthest = std::max(farthest, p_W.x());
  }
  EXPECT_GT(farthest, 45);
  EXPECT_FALSE(tour.isUnderWay());
  EXPECT_LT((p_W - Vector3d(25, -50, 0)).norm(), 1);
}

}  // namespace
}  // namespace filiform::internal
