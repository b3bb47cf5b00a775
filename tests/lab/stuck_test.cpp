#include "tools/lab/evaluate/trials/stuck.h"

#include "tests/lab/evaluation_cells.h"

#include <cmath>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

// A V: from (-30, 40) down to the origin and up to (30, 40), 50 um a leg.
Cell vee() { return test::cellOf({{-30, 40, 0}, {0, 0, 0}, {30, 40, 0}}, {kNoParent, 0, 1}); }

TEST(Stuck, InherentWhereNoPointIsNearer) {
  TrialCell cell(vee());
  const ProxyPlace corner = cell.placeAt(1, 0);
  EXPECT_TRUE(inherentlyStuck(cell, corner, {0, -5, 0}));
  EXPECT_TRUE(std::isinf(leastClimb_um(cell, corner, {0, -5, 0})));
  EXPECT_FALSE(inherentlyStuck(cell, corner, {20, 30, 0}));
}

TEST(Stuck, FallingIsFree) {
  TrialCell cell(vee());
  EXPECT_DOUBLE_EQ(leastClimb_um(cell, cell.placeAt(1, 0), {20, 30, 0}), 0);
}

TEST(Stuck, TheLeastClimbIsTheRiseToTheCorner) {
  TrialCell cell(vee());
  // The probe is above the right leg, nearer to it than to the proxy's place on the left leg. The way there leads down
  // to the corner, away from the probe.
  const Vector3d h_W(12, 34, 0);
  const ProxyPlace left = cell.placeAt(1, closestPoint({0, 0, 0}, {-30, 40, 0}, h_W).t);
  ASSERT_GT(left.t, 0);
  ASSERT_LT(left.t, 1);
  EXPECT_NEAR(leastClimb_um(cell, left, h_W), 50 * left.t, 1e-9);
}

TEST(Stuck, ClimbsOfOneWayAddUp) {
  // A zigzag of four legs. The probe is nearest to the last leg, and every second leg rises.
  TrialCell cell(test::cellOf({{0, 0, 0}, {10, 0, 0}, {0, 1, 0}, {10, 2, 0}, {5, 3, 0}}, {kNoParent, 0, 1, 2, 3}));
  const Vector3d h_W(5, 20, 0);
  const double climb = leastClimb_um(cell, cell.placeAt(1, 0.5), h_W);
  // 5 um from the first leg's closest point to its end. The second leg's closest point is then nearer.
  EXPECT_NEAR(climb, 5, 1e-9);
}

}  // namespace
}  // namespace filiform::tools
