#include "viewer/window/travel/internal/hand_path.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(HandPath, LeadsAheadOfTheProxyAndEndsAtItsEnd) {
  HandPath path;
  EXPECT_FALSE(path.isUnderWay());
  path.begin({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}});
  EXPECT_LT((path.aim_W({0, 1, 0}, 4) - Vector3d(4, 0, 0)).norm(), 1e-12);
  EXPECT_LT((path.aim_W({8, -1, 0}, 4) - Vector3d(10, 2, 0)).norm(), 1e-12);  // around the corner
  EXPECT_LT((path.aim_W({10, 9, 0}, 4) - Vector3d(10, 10, 0)).norm(), 1e-12);
  EXPECT_TRUE(path.isUnderWay());
  path.aim_W({10, 9.8, 0}, 4);
  EXPECT_FALSE(path.isUnderWay());
}

// A path that crosses itself: the part after the crossing must not be mistaken for the current one.
TEST(HandPath, IsNotCutShortWhereItCrossesItself) {
  HandPath path;
  path.begin({{0, 0, 0}, {50, 0, 0}, {50, 50, 0}, {25, 50, 0}, {25, -50, 0}});
  Vector3d p_W = Vector3d::Zero();
  double farthest = 0;
  for (int i = 0; i < 1000 && path.isUnderWay(); ++i) {
    p_W += 0.5 * (path.aim_W(p_W, 5) - p_W);
    farthest = std::max(farthest, p_W.x());
  }
  EXPECT_GT(farthest, 45);
  EXPECT_FALSE(path.isUnderWay());
  EXPECT_LT((p_W - Vector3d(25, -50, 0)).norm(), 1);
}

}  // namespace
}  // namespace filiform::internal
