#include "tools/bench/peers.h"

#include "index/closest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(Peers, EachInTheBuildIsExact) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(0, 200), step(-9, 9);
  std::vector<SegmentEnds> segments;
  for (int i = 0; i < 400; ++i) {
    const Vector3d a_W(place(random), place(random), place(random));
    // Some of no length, as samples without links are.
    segments.push_back({a_W, i % 20 == 0 ? a_W : Vector3d(a_W + Vector3d(step(random), step(random), step(random)))});
  }
  int raced = 0;
  for (const Peer& peer : peers()) {
    SCOPED_TRACE(peer.name);
    EXPECT_EQ(peer.version.empty(), !peer.build);
    if (!peer.build) continue;
    ++raced;
    const SquaredDistance squared = peer.build(segments);
    for (int i = 0; i < 100; ++i) {
      const Vector3d h_W(3 * place(random) - 200, place(random), place(random));
      double best = std::numeric_limits<double>::infinity();
      for (const auto& [a_W, b_W] : segments) best = std::min(best, closestPoint(a_W, b_W, h_W).squared_distance);
      EXPECT_NEAR(std::sqrt(squared(h_W)), std::sqrt(best), 1e-6);
    }
  }
  EXPECT_GE(raced, 2);  // CGAL and FLANN are in every build
}

TEST(Peers, AreNamedOnceEach) {
  std::set<std::string> names;
  for (const Peer& peer : peers()) EXPECT_TRUE(names.insert(peer.name).second) << peer.name;
  EXPECT_EQ(names.size(), 5u);
}

}  // namespace
}  // namespace filiform::tools
