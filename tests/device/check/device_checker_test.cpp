#include "device/check/device_checker.h"

#include "device/simulated/simulated_hand.h"

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

// Runs in the hand's virtual time, as the loop's clock would show it.
DeviceCheck check(SimulatedHand& hand, const DeviceCheckOptions& options, bool renders_force = true) {
  constexpr double kPeriod_s = 0.001;
  DeviceChecker checker(options, renders_force);
  DeviceChecker::Clock::time_point now{};
  hand.open();
  Wrench wrench;
  for (int tick = 0; tick < 10'000 && !checker.over(); ++tick) {
    now += std::chrono::milliseconds(1);
    wrench = checker.tick(hand.exchange(wrench), kPeriod_s, now);
  }
  EXPECT_TRUE(checker.over());
  EXPECT_EQ(wrench.force_N, Eigen::Vector3d::Zero());
  hand.close();
  return checker.found();
}

// A hand that yields to f at k N/m moves by f / k.
TEST(DeviceChecker, FeelsHowTheHandGivesWay) {
  SimulatedHandOptions options;
  options.hand = handParameters("medium");
  SimulatedHand hand(options);
  const DeviceCheck found = check(hand, {.read_s = 0.1, .ramp_s = 0.5});
  EXPECT_EQ(found.exchanges, 100U);
  EXPECT_NEAR(found.rate_Hz, 1000, 1e-6);
  EXPECT_NEAR(found.longest_gap_s, 0.001, 1e-9);
  EXPECT_FALSE(found.stopped);
  EXPECT_NEAR(found.force_N, 0.5, 0.01);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(found.moved_m[axis], 0.5 * found.force_N / options.hand.stiffness_N_m) << axis;
    EXPECT_LT(found.moved_m[axis], 1.5 * found.force_N / options.hand.stiffness_N_m) << axis;
  }
}

TEST(DeviceChecker, EndsTheForceWhereTheHandGivesWayTooFar) {
  SimulatedHandOptions options;
  options.hand = handParameters("loose");
  SimulatedHand hand(options);
  const DeviceCheck found = check(hand, {.read_s = 0.05, .most_moved_m = 0.002});
  EXPECT_TRUE(found.stopped);
  EXPECT_GT(found.force_N, 0);
  EXPECT_LT(found.force_N, 0.3);
  EXPECT_EQ(found.moved_m.z(), 0);
}

TEST(DeviceChecker, OnlyReadsWhereThereIsNoForce) {
  SimulatedHand hand(SimulatedHandOptions{});
  const DeviceCheck found = check(hand, {.read_s = 0.05}, false);
  EXPECT_EQ(found.force_N, 0);
  EXPECT_EQ(found.exchanges, 50U);
}

}  // namespace
}  // namespace filiform::tools
