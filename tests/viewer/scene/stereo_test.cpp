#include "viewer/scene/stereo.h"

#include "index/errors.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

constexpr PictureSize kSize{1280, 800};

TEST(Stereo, ModesHaveNames) {
  for (const StereoMode mode : kStereoModes) EXPECT_EQ(stereoMode(toString(mode)), mode);
  EXPECT_THROW(stereoMode("3d"), UsageError);
}

TEST(Stereo, EachEyeHasItsShareOfThePicture) {
  EXPECT_EQ(eyeSize(StereoMode::side_by_side, kSize).width, 640);
  EXPECT_EQ(eyeSize(StereoMode::top_bottom, kSize).height, 400);
  EXPECT_EQ(eyeSize(StereoMode::row_interleaved, kSize).height, 800);
  EXPECT_EQ(eyeSize(StereoMode::side_by_side, {1, 1}).width, 1);
}

// The shift of a point between the two pictures is e (z - d) / z on the plane of convergence.
TEST(Stereo, ParallaxFollowsTheFormulaAndNothingMovesUpwards) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> part(-0.3, 0.3);
  const Camera camera = lookAt({3000, 40, 500}, {2900, 90, 100}, {0.1, 1, 0});
  const double d = camera.focus_um, ratio = 1.0 / 30;
  const double width_um = 2 * d * std::tan(camera.height_angle_rad / 2) * kSize.aspect();
  const auto views = stereoViews(camera, kSize.aspect(), ratio);
  for (int round = 0; round < 200; ++round) {
    const double z = d * (0.5 + 2.5 * (part(random) + 0.3));
    const Vector3d p_V(part(random) * z, part(random) * z, -z);
    const Vector3d p_W = camera.eye_W + camera.rotation_VW.transpose() * p_V;
    const ScreenPoint left = project(views[0], p_W, kSize), right = project(views[1], p_W, kSize);
    EXPECT_NEAR(right.x - left.x, ratio * d * (z - d) / z / width_um * kSize.width, 1e-6);
    EXPECT_NEAR(right.y, left.y, 1e-9);
  }
  const ScreenPoint left = project(views[0], camera.focus_W(), kSize);
  const ScreenPoint right = project(views[1], camera.focus_W(), kSize);
  EXPECT_NEAR(left.x, right.x, 1e-9);
}

TEST(Stereo, NoParallaxBeyondTheLargest) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> part(0, 1);
  const StereoOptions options;
  const Camera camera;
  const double tan_across = std::tan(camera.height_angle_rad / 2) * kSize.aspect();
  for (int round = 0; round < 500; ++round) {
    const double d = 100, nearest = d * (0.25 + 0.7 * part(random)), farthest = d * (1.05 + 10 * part(random));
    const double e = separationRatio(options, d, nearest, farthest, tan_across) * d;
    if (e <= kMinSeparation * d * 1.0001) continue;  // clamped: some depth always remains
    const double width = 2 * d * tan_across;
    const auto parallax = [&](double z) { return std::abs(e * (z - d) / z) / width; };
    EXPECT_LE(parallax(nearest), options.largest_parallax * 1.000001);
    EXPECT_LE(parallax(farthest), options.largest_parallax * 1.000001);
    if (e < kMaxSeparation * d * 0.9999) {  // not clamped: the largest parallax is reached
      EXPECT_NEAR(std::max(parallax(nearest), parallax(farthest)), options.largest_parallax, 1e-9);
    }
  }
}

TEST(Stereo, FlatScenesAndGain) {
  EXPECT_DOUBLE_EQ(separationRatio({}, 100, 100, 100, 0.5), kMaxSeparation);
  EXPECT_DOUBLE_EQ(separationRatio({}, 100, 1e-3, 1e6, 0.5), kMinSeparation);
  EXPECT_EQ(separationRatio({.gain = 0}, 100, 50, 200, 0.5), 0);
}

TEST(Stereo, WideningShowsMoreOfTheSamePlace) {
  const Camera camera = lookAt({0, 0, 100}, {0, 0, 0});
  const auto usual = stereoViews(camera, 1.6, 0.03), wide = stereoViews(camera, 1.6, 0.03, 1.25);
  const Vector3d p_W(5, 7, 0);
  const ScreenPoint a = project(usual[0], p_W, kSize), b = project(wide[0], p_W, kSize);
  EXPECT_NEAR((a.x - 640) / (b.x - 640), 1.25, 1e-9);
  EXPECT_NEAR((a.y - 400) / (b.y - 400), 1.25, 1e-9);
  EXPECT_NEAR(project(wide[1], p_W, kSize).x, b.x, 1e-9);  // still converges there
}

TEST(SeparationFilter, StartsAtTheWishAndFollowsSlowly) {
  SeparationFilter filter;
  EXPECT_DOUBLE_EQ(filter.update(0.05, 0.016), 0.05);
  double ratio = 0, before = 0.05;
  for (int frame = 0; frame < 126; ++frame) {  // 2.1 s
    ratio = filter.update(0.02, 1.0 / 60);
    EXPECT_LT(before - ratio, 0.03 / 0.7 / 60 * 1.01);
    EXPECT_LT(ratio, before);
    before = ratio;
  }
  EXPECT_NEAR(ratio, 0.02 + 0.03 * std::exp(-3), 1e-6);
  EXPECT_EQ(filter.update(1, 0), ratio);
}

TEST(SeparationFilter, DoesNotDependOnTheFrameRate) {
  SeparationFilter slow, fast;
  slow.update(0.05, 0);
  fast.update(0.05, 0);
  double fast_ratio = 0;
  for (int i = 0; i < 10; ++i) fast_ratio = fast.update(0.01, 0.01);
  EXPECT_NEAR(slow.update(0.01, 0.1), fast_ratio, 1e-12);
}

}  // namespace
}  // namespace filiform
