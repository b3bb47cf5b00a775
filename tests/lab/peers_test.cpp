#include "tools/lab/bench/peers.h"

#include "index/geometry/closest_point.h"
#include "tests/support/sanitized.h"
#include "tools/lab/bench/bench.h"
#include "tools/lab/bench/index/jump_race.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
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
    // Some segments have length 0, like those of samples without links.
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

TEST(JumpRace, MeasuresMemoryByTheGrowthOfTheProcess) {
  if (test::kSanitized) GTEST_SKIP() << "memory is laid out otherwise under a sanitizer";
  const std::vector<SegmentEnds> segments(200'000, SegmentEnds{Vector3d::Zero(), Vector3d::Zero()});
  const auto setting = [](bool keeps) {
    return PeerSetting{"", keeps, [](const std::vector<SegmentEnds>& all) -> SquaredDistance {
                         std::vector<char> freed(all.size() * 100, 1);  // freed while building: must not count
                         const auto kept = std::make_shared<std::vector<char>>(all.size() * 64 + (freed[5] == 0), 1);
                         return [kept](const Vector3d&) { return static_cast<double>(kept->front()); };
                       }};
  };
  const JumpEngine copies = builtEngine("copies", setting(false), segments);
  EXPECT_NEAR(copies.bytes, 64, 4);
  const JumpEngine reads = builtEngine("reads", setting(true), segments);
  EXPECT_NEAR(reads.bytes, 64 + 48, 4);
  EXPECT_EQ(reads.squared(Vector3d::Zero()), 1);
}

TEST(JumpRace, RefusesAnEngineThatAnswersOtherwise) {
  const JumpEngine one{"one", [](const Vector3d& h_W) { return h_W.squaredNorm(); }};
  const JumpEngine other{"other", [](const Vector3d& h_W) { return h_W.squaredNorm() + (h_W.x() > 1 ? 0.1 : 0); }};
  const std::vector<Vector3d> right{{0, 1, 2}, {1, 1, 1}}, wrong{{0, 1, 2}, {2, 1, 1}};
  const std::vector<Raced> raced = raceJumps({one, other}, right);
  ASSERT_EQ(raced.size(), 2u);
  EXPECT_EQ(raced[1].ns.size(), static_cast<std::size_t>(kBatches));
  EXPECT_NEAR(raced[1].recall, 1, 1e-12);
  EXPECT_THROW(raceJumps({one, other}, wrong), std::runtime_error);
}

TEST(Peers, AreNamedOnceEach) {
  std::set<std::string> names;
  for (const Peer& peer : peers()) EXPECT_TRUE(names.insert(peer.name).second) << peer.name;
  EXPECT_EQ(names.size(), 5u);
}

}  // namespace
}  // namespace filiform::tools
