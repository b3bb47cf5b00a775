#include "viewer/scene/glyph.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(Glyph, OwnBranchDiffersInColourAndInShape) {
  Junction junction;
  junction.p_W = Vector3d(1e6, 0, 0);
  for (int i = 0; i < 3; ++i) {
    Branch branch;
    branch.own = i == 1;
    branch.points_W = {junction.p_W, junction.p_W + Vector3d(i - 1.0, 1, 0.25 * i)};
    junction.branches.push_back(branch);
  }
  for (const GlyphPalette& palette : {kRedGreen, kOrangeBlue, kForGlasses}) {
    const NeuriteBatch glyph = glyphBatch(junction, 10, 0.4, palette);
    EXPECT_EQ(glyph.origin_W, junction.p_W);
    int own = 0, other = 0, filled = 0;
    double farthest[2] = {0, 0};
    float thickest_other = 0, thinnest_own_line = 1e9F;
    for (const DrawnSegment& s : glyph.segments) {
      const bool is_own = s.paint == paintOf(palette.own);
      ASSERT_TRUE(is_own || s.paint == paintOf(palette.other));
      ++(is_own ? own : other);
      farthest[is_own] = std::max<double>(farthest[is_own], Eigen::Vector3f(s.b_um[0], s.b_um[1], s.b_um[2]).norm());
      if (is_own && s.a_radius_um != s.b_radius_um) ++filled;
      if (is_own && s.a_radius_um == s.b_radius_um) thinnest_own_line = std::min(thinnest_own_line, s.a_radius_um);
      if (!is_own) thickest_other = std::max(thickest_other, s.a_radius_um);
    }
    EXPECT_EQ(own, 2);  // a line and a head
    EXPECT_EQ(filled, 1);
    EXPECT_EQ(other, 2 * (1 + 32));
    EXPECT_GT(thinnest_own_line, 1.5 * thickest_other);
    EXPECT_NEAR(farthest[0], 10, 0.01);
    EXPECT_NEAR(farthest[1], 10, 0.01);
  }
  EXPECT_NE(kRedGreen.own, kOrangeBlue.own);
}

// Each colour is equally bright behind the red glass (which shows luminance) and the cyan glass. One of the two colours
// is much brighter than the other.
TEST(Glyph, IsSeenThroughRedAndCyanGlasses) {
  const auto luminance = [](const Rgba& c) { return 0.299 * c.r + 0.587 * c.g + 0.114 * c.b; };
  EXPECT_GT(luminance(kForGlasses.own), 200);
  EXPECT_GT(luminance(kForGlasses.own), 1.8 * luminance(kForGlasses.other));
  EXPECT_GT(luminance(kForGlasses.other), 90);
}

}  // namespace
}  // namespace filiform
