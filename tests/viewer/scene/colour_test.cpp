#include "viewer/scene/colour.h"

#include <cmath>
#include <cstdlib>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// Relative luminance as WCAG defines it.
double luminance(Rgba c) {
  const auto linear = [](int v) {
    const double s = v / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(c.r) + 0.7152 * linear(c.g) + 0.0722 * linear(c.b);
}

TEST(Colour, WithoutChromaIsGreyAndLightnessIsTheCubeRoot) {
  for (const double lightness : {0.0, 0.3, 0.5, 0.8, 1.0}) {
    const Rgba c = lightnessChromaHue(lightness, 0, 1);
    EXPECT_LE(std::abs(c.r - c.g), 1);
    EXPECT_LE(std::abs(c.g - c.b), 1);
    EXPECT_NEAR(luminance(c), lightness * lightness * lightness, 0.01);
  }
}

TEST(Colour, RampGrowsEvenlyLighter) {
  double before = -1;
  for (int i = 0; i <= 10; ++i) {
    const double now = luminance(colourOnRamp(i / 10.0));
    EXPECT_GT(now, before + 0.01);
    before = now;
  }
  EXPECT_EQ(colourOnRamp(-3), colourOnRamp(0));
  EXPECT_EQ(colourOnRamp(7), colourOnRamp(1));
  EXPECT_EQ(colourOnRamp(NAN), (Rgba{128, 128, 128}));
}

TEST(Colour, NumbersAreToldApartOnBlack) {
  std::set<std::tuple<int, int, int>> seen;
  for (std::uint64_t i = 0; i < 60; ++i) {
    const Rgba c = colourOfNumber(i), next = colourOfNumber(i + 1);
    seen.insert({c.r, c.g, c.b});
    EXPECT_GT(luminance(c), 0.2);
    EXPECT_GT(std::abs(c.r - next.r) + std::abs(c.g - next.g) + std::abs(c.b - next.b), 60);
  }
  EXPECT_EQ(seen.size(), 60u);
}

}  // namespace
}  // namespace filiform
