#include "viewer/scene/overlay.h"

#include <numbers>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(Overlay, TheStylusPointsWhereItsShaftPoints) {
  Stylus stylus;
  stylus.tip_W = {100, 200, 300};
  stylus.rotation_WS = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitY());  // z becomes x, y stays
  const NeuriteBatch batch = stylusBatch(stylus, 50);
  ASSERT_EQ(batch.segments.size(), 2U);
  EXPECT_EQ(batch.origin_W, stylus.tip_W);
  const DrawnSegment& shaft = batch.segments[0];
  EXPECT_FLOAT_EQ(shaft.a_um[0], 0);
  EXPECT_NEAR(shaft.b_um[0], 50, 1e-4);
  EXPECT_NEAR(shaft.b_um[2], 0, 1e-4);
  EXPECT_LT(shaft.a_radius_um, shaft.b_radius_um);
  EXPECT_NEAR(batch.segments[1].b_um[1], 7.5, 1e-4) << "the bar shows the roll";
  for (const DrawnSegment& segment : batch.segments)
    for (int axis = 0; axis < 3; ++axis)
      for (const float end : {segment.a_um[axis], segment.b_um[axis]}) {
        EXPECT_GE(stylus.tip_W[axis] + end, batch.lo_W[axis] - 1e-4);
        EXPECT_LE(stylus.tip_W[axis] + end, batch.hi_W[axis] + 1e-4);
      }
}

TEST(Overlay, RegionsAreBoxesOfTheWorkspace) {
  Workspace workspace({.zoom_um = 240, .static_fraction = 0.5});
  workspace.place({1000, 2000, 3000}, {0, 0, 0});
  workspace.rotate(0.4, 0.2, {1000, 2000, 3000});
  const NeuriteBatch boxes = workspaceBatch(workspace, 1);
  ASSERT_EQ(boxes.segments.size(), 24u);
  int outer = 0;
  for (const DrawnSegment& s : boxes.segments) {
    const Vector3d a = boxes.origin_W + Vector3d(s.a_um[0], s.a_um[1], s.a_um[2]);
    const Vector3d b = boxes.origin_W + Vector3d(s.b_um[0], s.b_um[1], s.b_um[2]);
    const bool dynamic = s.paint == paintOf(kDynamicColour);
    outer += dynamic;
    EXPECT_NEAR((b - a).norm(), dynamic ? 240 : 120, 1e-3);
    for (const Vector3d& p : {a, b})
      EXPECT_LT((workspace.toDevice(p).cwiseAbs() - Vector3d::Constant(dynamic ? 0.06 : 0.03)).norm(), 1e-6);
  }
  EXPECT_EQ(outer, 12);
}

}  // namespace
}  // namespace filiform
