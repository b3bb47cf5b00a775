#include "index/levels/internal/pictures.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <random>
#include <set>
#include <utility>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::Pictures;
using internal::Places;

// The pixels of a segment in one picture, one step after another.
std::set<std::pair<int, int>> pixelsOfSegment(const Places& a, const Places& b, std::size_t view) {
  const std::int32_t x = b.x[view] - a.x[view], y = b.y[view] - a.y[view];
  const std::int32_t steps = std::max(std::abs(x), std::abs(y)) / 65536 + 1;
  std::set<std::pair<int, int>> pixels{{b.x[view] >> 16, b.y[view] >> 16}};
  for (std::int32_t i = 0; i < steps; ++i)
    pixels.emplace((a.x[view] + x / steps * i) >> 16, (a.y[view] + y / steps * i) >> 16);
  return pixels;
}

TEST(Pictures, ASegmentIsCoveredExactlyIfAllItsPixelsAre) {
  std::mt19937 random(3);
  const auto upTo = [&](double most) { return most * static_cast<double>(random()) / 4294967296.0; };
  for (const Vector3d& size : {Vector3d(60, 45, 30), Vector3d(200, 1, 90), Vector3d(8, 8, 8), Vector3d(0, 0, 0)}) {
    Pictures pictures(size);
    std::array<std::set<std::pair<int, int>>, Pictures::kViews> painted;
    int covered = 0, others = 0;
    for (int i = 0; i < 4000; ++i) {
      const Vector3d p(upTo(size.x()), upTo(size.y()), upTo(size.z()));
      const double length = i % 10 == 0 ? 100 : 12;
      const Vector3d q = (p + Vector3d(upTo(length), upTo(length), upTo(length)) - Vector3d::Constant(length / 2))
                             .cwiseMax(Vector3d::Zero())
                             .cwiseMin(size);
      const Places a = pictures.placesOf(p), b = pictures.placesOf(q);
      bool wanted = true;
      for (std::size_t view = 0; view < Pictures::kViews; ++view) {
        const auto pixels = pixelsOfSegment(a, b, view);
        wanted = wanted && std::includes(painted[view].begin(), painted[view].end(), pixels.begin(), pixels.end());
      }
      ASSERT_EQ(pictures.covered(a, b), wanted) << i;
      (wanted ? covered : others) += 1;
      if (wanted) continue;
      pictures.paint(a, b);
      ASSERT_TRUE(pictures.covered(a, b));
      for (std::size_t view = 0; view < Pictures::kViews; ++view) painted[view].merge(pixelsOfSegment(a, b, view));
    }
    EXPECT_GT(covered, 100);
    EXPECT_GT(others, 0);
  }
}

TEST(Pictures, FourCornersSpeakForShortSegmentsAlone) {
  Pictures pictures(Vector3d(100, 100, 1));
  const auto at = [&](double x, double y) { return pictures.placesOf({x, y, 0}); };
  for (double y = 0; y <= 100; y += 0.5) {  // all but a strip
    pictures.paint(at(0, y), at(40, y));
    pictures.paint(at(60, y), at(100, y));
  }
  EXPECT_FALSE(pictures.covered(at(20, 50), at(80, 50)));
}

}  // namespace
}  // namespace filiform
