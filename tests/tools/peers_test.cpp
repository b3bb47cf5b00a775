#include "tools/bench/peers.h"

#include "index/closest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(Peers, EachSettingInTheBuildIsExact) {
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
    EXPECT_EQ(peer.version.empty(), !peer.inBuild());
    if (!peer.inBuild()) continue;
    ++raced;
    EXPECT_FALSE(peer.best().name.empty());
    std::set<std::string> names;
    for (const PeerSetting& setting : peer.settings) {
      SCOPED_TRACE(setting.name);
      EXPECT_TRUE(names.insert(setting.name).second);
      const SquaredDistance squared = setting.build(segments);
      for (int i = 0; i < 30; ++i) {
        const Vector3d h_W(3 * place(random) - 200, place(random), place(random));
        double best = std::numeric_limits<double>::infinity();
        for (const auto& [a_W, b_W] : segments) best = std::min(best, closestPoint(a_W, b_W, h_W).squared_distance);
        EXPECT_NEAR(std::sqrt(squared(h_W)), std::sqrt(best), 1e-6);
      }
    }
  }
  EXPECT_GE(raced, 2);  // CGAL and FLANN are in every build
}

TEST(Peers, RaceASettingThatTheyHave) {
  const Peer peer{"one", "1", {{"slow", false, {}}, {"fast", false, {}}}};
  EXPECT_EQ(racedWith(peer, "fast").best().name, "fast");
  EXPECT_THROW(racedWith(peer, "none"), std::logic_error);
}

TEST(Peers, AreNamedOnceEach) {
  std::set<std::string> names;
  for (const Peer& peer : peers()) EXPECT_TRUE(names.insert(peer.name).second) << peer.name;
  EXPECT_EQ(names.size(), 5u);
}

}  // namespace
}  // namespace filiform::tools
