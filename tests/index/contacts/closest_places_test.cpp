#include "index/contacts/closest_places.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

double surfaceDistance_um(const SegmentEnds& a, const SegmentEnds& b, double u, double v) {
  return (a.at(u) - b.at(v)).norm() - a.radiusAt_um(u) - b.radiusAt_um(v);
}

// The least distance on a lattice of places, refined about its best place: the function is convex.
double searchedDistance_um(const SegmentEnds& a, const SegmentEnds& b) {
  double u = 0.5, v = 0.5, best = surfaceDistance_um(a, b, u, v);
  for (double reach = 0.5; reach > 1e-9; reach *= 0.7) {
    const double from_u = u, from_v = v;
    for (int i = -8; i <= 8; ++i)
      for (int j = -8; j <= 8; ++j) {
        const double x = std::clamp(from_u + reach * i / 8, 0.0, 1.0), y = std::clamp(from_v + reach * j / 8, 0.0, 1.0);
        if (const double d = surfaceDistance_um(a, b, x, y); d < best) best = d, u = x, v = y;
      }
  }
  return best;
}

SegmentEnds randomEnds(std::mt19937_64& random, double radius_um) {
  const auto number = [&](double most) { return most * static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto point = [&] {
    // Some on a lattice, so that segments meet, are parallel, or have no length.
    const bool whole = random() % 3 == 0;
    Vector3d p(number(8), number(8), number(8));
    if (whole) p = Vector3d(std::floor(p[0] / 3), std::floor(p[1] / 3), std::floor(p[2] / 3));
    return p;
  };
  const auto radius = [&] { return random() % 3 == 0 ? 0 : number(radius_um); };
  const Vector3d child = point(), parent = random() % 10 == 0 ? child : point();
  const double child_radius = radius();
  return {child, parent, child_radius, radius()};
}

TEST(ClosestPlaces, AreAsCloseAsASearchFindsThem) {
  const std::uint64_t seed = 20261129;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 4000; ++i) {
    const SegmentEnds a = randomEnds(random, 3), b = randomEnds(random, 3);
    const ClosestPlaces surfaces = closestOnSurfaces(a, b);
    EXPECT_LE(surfaces.distance_um, searchedDistance_um(a, b) + 1e-9) << i;
    EXPECT_EQ(surfaces.distance_um, surfaceDistance_um(a, b, surfaces.t[0], surfaces.t[1])) << i;
    const SegmentEnds line{a.child_W, a.parent_W}, other{b.child_W, b.parent_W};
    const ClosestPlaces axes = closestOnAxes(line, other);
    EXPECT_LE(axes.distance_um, searchedDistance_um(line, other) + 1e-9) << i;
    EXPECT_NEAR(axes.distance_um, closestOnSurfaces(line, other).distance_um, 1e-9) << i;
    EXPECT_NEAR(axes.distance_um, (line.at(axes.t[0]) - other.at(axes.t[1])).norm(), 1e-12) << i;
  }
}

TEST(ClosestPlaces, ExactWhereNumbersAreWhole) {
  const SegmentEnds x{{0, 0, 0}, {4, 0, 0}}, y{{2, 3, 0}, {2, 9, 0}}, beside{{1, 2, 0}, {3, 2, 0}};
  EXPECT_EQ(closestOnAxes(x, y).distance_um, 3);
  EXPECT_EQ(closestOnAxes(x, y).t[0], 0.5);
  EXPECT_EQ(closestOnAxes(x, y).t[1], 0);
  EXPECT_EQ(closestOnAxes(x, beside).distance_um, 2);
  EXPECT_EQ(closestOnAxes(x, beside).t[1], 0) << "of equally close places, the child";
  const SegmentEnds across{{2, -1, 5}, {2, 1, 5}};
  EXPECT_EQ(closestOnAxes(x, across).distance_um, 5);
  EXPECT_EQ(closestOnAxes(x, across).t[1], 0.5);
  const SegmentEnds thick{{0, 0, 0}, {4, 0, 0}, 1, 1}, ball{{2, 6, 0}, {2, 6, 0}, 2, 2};
  EXPECT_EQ(closestOnSurfaces(thick, ball).distance_um, 3);
  const SegmentEnds inside{{2, 0.5, 0}, {3, 0.5, 0}, 0.25, 0.25};
  EXPECT_LT(closestOnSurfaces(thick, inside).distance_um, 0) << "they overlap";
}

}  // namespace
}  // namespace filiform
