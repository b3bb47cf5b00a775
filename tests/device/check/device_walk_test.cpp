#include "device/check/device_walk.h"

#include "device/simulated/simulated_hand.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

constexpr DeviceWalkOptions kShort{
    .workspace_s = 0.5, .gravity_s = 0.2, .spring_s = 0.5, .damping_s = 1, .pause_s = 0.5};

// Walks in the hand's virtual time. `led_m`: the hand's person moves it so far along x while the walk asks for it.
DeviceWalkFound walk(SimulatedHand& hand, double most_N_m, double led_m = 0,
                     const DeviceWalkOptions& options = kShort) {
  DeviceWalk walk(options, true, most_N_m);
  hand.open();
  Wrench wrench;
  double time_s = 0, strongest_N = 0;
  for (; time_s < 60 && !walk.over(); time_s += 0.001) {
    const bool is_led = walk.phase() == DeviceWalk::Phase::workspace || walk.phase() == DeviceWalk::Phase::damping;
    hand.setTarget({is_led ? led_m * std::sin(2 * M_PI * 2 * time_s) : 0, 0, 0});
    wrench = walk.tick(hand.exchange(wrench), 0.001);
    strongest_N = std::max(strongest_N, wrench.force_N.norm());
  }
  EXPECT_TRUE(walk.over());
  EXPECT_EQ(wrench.force_N, Eigen::Vector3d::Zero());
  EXPECT_LE(strongest_N, options.force_N + 1e-12);
  return walk.found();
}

SimulatedHandOptions mediumHand() {
  SimulatedHandOptions options;
  options.hand = handParameters("medium");
  return options;
}

TEST(DeviceWalk, FindsWhatAHandFeels) {
  SimulatedHand hand(mediumHand());
  const DeviceWalkFound found = walk(hand, 200, 0.03);
  EXPECT_GT(found.hi_D.x() - found.lo_D.x(), 0.04);
  EXPECT_LT(found.hi_D.y() - found.lo_D.y(), 1e-9);
  // A spring of 50 N/m, stretched by 10 mm, against a hand of 200 N/m: a fifth of the way.
  for (const DeviceWalkFound::Spring& spring : found.springs) {
    EXPECT_FALSE(spring.stopped);
    EXPECT_NEAR(spring.moved_m, 0.002, 3e-4);
    EXPECT_NEAR(spring.force_N, 0.4, 0.03);
  }
  EXPECT_GT(found.damped_J, 1e-4);
  EXPECT_GT(found.fastest_damped_m_s, 0.1);
  ASSERT_EQ(found.sweep.size(), 4U);
  EXPECT_EQ(found.sweep.back().stiffness_N_m, 200);
  for (const DeviceWalkFound::Step& step : found.sweep) EXPECT_FALSE(step.vibrates) << step.stiffness_N_m;
}

// A hand without damping of its own, with the longest delay: it vibrates at any stiffness worth the name.
TEST(DeviceWalk, TheSweepEndsWhereItVibrates) {
  SimulatedHandOptions options = mediumHand();
  options.hand.damping_Ns_m = 0;
  options.device_damping_Ns_m = 0.3;
  options.delay_samples = 2;
  SimulatedHand hand(options);
  const DeviceWalkFound found = walk(hand, 3200);
  ASSERT_FALSE(found.sweep.empty());
  EXPECT_TRUE(found.sweep.back().vibrates);
  EXPECT_LT(found.sweep.back().stiffness_N_m, 3200);
  EXPECT_GE(found.sweep.back().stiffness_N_m, 100);
}

TEST(DeviceWalk, ASpringEndsIfTheHandleMovesTooFar) {
  SimulatedHandOptions options = mediumHand();
  options.hand = handParameters("loose");
  SimulatedHand hand(options);
  DeviceWalkOptions walk_options = kShort;
  walk_options.most_moved_m = 0.002;
  const DeviceWalkFound found = walk(hand, 100, 0, walk_options);
  for (const DeviceWalkFound::Spring& spring : found.springs) EXPECT_TRUE(spring.stopped);
}

TEST(DeviceWalk, WithoutForceItLooksAtTheWorkspaceOnly) {
  SimulatedHand hand(mediumHand());
  DeviceWalk walk(kShort, false, 200);
  hand.open();
  for (int i = 0; i < 600 && !walk.over(); ++i)
    EXPECT_EQ(walk.tick(hand.exchange({}), 0.001).force_N, Eigen::Vector3d::Zero());
  EXPECT_TRUE(walk.over());
  EXPECT_TRUE(walk.found().sweep.empty());
}

}  // namespace
}  // namespace filiform::tools
