#include "solver/proxy/anchor.h"

#include "index/errors.h"
#include "tests/support/numbers.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::kDt_s;
using test::kInfinity;
using test::kNaN;

Vector3d cube(std::mt19937_64& random, double reach) {
  std::uniform_real_distribution<double> unit(-reach, reach);
  const double x = unit(random), y = unit(random), z = unit(random);
  return {x, y, z};
}

TEST(Anchor, WalksNoFasterThanItsSpeedAndTheHandsAndNeverAwayFromBoth) {
  constexpr std::uint64_t kSeed = 3;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  Anchor anchor({});
  Vector3d p_D(0, 0, 0), h_D(0, 0, 0), x_D(0, 0, 0), v_D(0, 0, 0);
  int walked = 0, fast = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d before_D = p_D;
    v_D += cube(random, 0.02) - 0.01 * v_D - 0.02 * h_D;
    const Vector3d h_before_D = h_D;
    h_D += v_D * kDt_s;
    p_D += i % 300 == 0 ? cube(random, 0.02) : cube(random, 1e-5);  // a jump now and then
    const Vector3d offset_D = anchor.advance(p_D - before_D, h_D, kDt_s);
    const Vector3d now_D = p_D + offset_D;
    const double step_m = (0.1 + std::min(anchor.hand_speed_m_s(), 0.2)) * kDt_s;
    fast += anchor.hand_speed_m_s() > 0.2;
    ASSERT_LE((now_D - x_D).norm(), step_m * (1 + 1e-9) + 1e-15);
    ASSERT_LE((now_D - h_D).norm(), std::max((x_D - h_D).norm(), (p_D - h_D).norm()) + 1e-15);
    // So the spring's force changes by at most K (step + |dh|).
    ASSERT_LE(((now_D - h_D) - (x_D - h_before_D)).norm(), step_m + (h_D - h_before_D).norm() + 1e-15);
    walked += !offset_D.isZero(0);
    x_D = now_D;
  }
  EXPECT_GT(walked, 2000);
  EXPECT_GT(fast, 1000);
}

TEST(Anchor, IsAtTheProxyExactlyAfterTheTimeThatTheDistanceTakes) {
  Anchor anchor({});
  const Vector3d h_D(0.01, 0, 0);
  anchor.advance(Vector3d::Zero(), h_D, kDt_s);
  anchor.advance({0, 0.005, 0}, h_D, kDt_s);  // 5 mm at 0.1 m/s: 50 ms
  int ticks = 1;
  while (!anchor.offset_D().isZero(0)) {
    anchor.advance(Vector3d::Zero(), h_D, kDt_s);
    ASSERT_LE(++ticks, 51);
  }
  EXPECT_GE(ticks, 50);
}

TEST(Anchor, KeepsUpWithAMovingHand) {
  const auto lag_mm = [](double share) {
    Anchor anchor({.speed_m_s = 0.1, .hand_share = share});
    for (int i = 0; i < 500; ++i) anchor.advance({2e-4, 0, 0}, {2e-4 * i, 0, 0}, kDt_s);  // both at 0.2 m/s
    return 1e3 * anchor.offset_D().norm();
  };
  EXPECT_LT(lag_mm(1.0), 0.4);  // the delay of the low-pass filter
  EXPECT_GT(lag_mm(0.0), 45);
}

TEST(Anchor, ASlippingHandDoesNotSpeedItUpBeyondItsLimit) {
  Anchor anchor({});
  Vector3d h_D(0, 0, 0);
  anchor.advance({0, 0, 0}, h_D, kDt_s);
  anchor.advance({-0.02, 0, 0}, h_D, kDt_s);  // the proxy jumps by 2 cm
  for (int i = 0; i < 60; ++i) {
    const Vector3d before_D = anchor.offset_D();
    h_D.x() += 1e-3;  // 1 m/s
    EXPECT_LE((anchor.advance(Vector3d::Zero(), h_D, kDt_s) - before_D).norm(), 0.3e-3 * (1 + 1e-9));
  }
}

// An encoder counts in steps: at 60 um and 1 kHz, one step is a tick of 60 mm/s.
TEST(Anchor, NoiseOfAnEncoderHardlySpeedsItUp) {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<int> one(-1, 1);
  Anchor anchor({});
  double sum_m_s = 0;
  constexpr int kTicks = 20000;
  for (int i = 0; i < kTicks; ++i) {
    anchor.advance(Vector3d::Zero(), 6e-5 * Vector3d(one(random), one(random), one(random)), kDt_s);
    sum_m_s += anchor.hand_speed_m_s();
  }
  EXPECT_LT(sum_m_s / kTicks, 0.03);  // without the filter the mean speed is 0.11
}

TEST(Anchor, ResetIsAtTheProxyAtRest) {
  Anchor anchor({});
  anchor.advance(Vector3d::Zero(), {0, 0, 0}, kDt_s);
  anchor.advance({0.01, 0, 0}, {0.001, 0, 0}, kDt_s);
  anchor.reset();
  EXPECT_TRUE(anchor.offset_D().isZero(0));
  EXPECT_EQ(anchor.hand_speed_m_s(), 0);
  anchor.advance(Vector3d::Zero(), {0.05, 0, 0}, kDt_s);  // the first position of a hand counts as no motion
  EXPECT_EQ(anchor.hand_speed_m_s(), 0);
}

TEST(Anchor, ArgumentsThatAreNotFiniteLeaveNoTrace) {
  for (const double bad : {kNaN, kInfinity, -kInfinity, 1e300}) {
    Anchor anchor({});
    anchor.advance({0.01, 0, 0}, {0, 0, 0}, kDt_s);
    EXPECT_TRUE(anchor.advance({bad, 0, 0}, {0, 0, 0}, kDt_s).allFinite());
    EXPECT_TRUE(anchor.advance({0, 0, 0}, {0, bad, 0}, kDt_s).allFinite());
    EXPECT_TRUE(anchor.advance({0, 0, 0}, {0, 0, 0}, kDt_s).allFinite());
  }
  Anchor anchor({});
  anchor.advance({0.01, 0, 0}, {0, 0, 0}, kDt_s);
  const Vector3d before_D = anchor.offset_D();
  for (const double dt_s : {0.0, -1.0, kNaN, kInfinity})
    EXPECT_EQ(anchor.advance({0, 0, 0}, {0, 0, 0}, dt_s), before_D);
}

TEST(Anchor, RefusesOptionsThatMakeNoSense) {
  for (const double bad : {-1.0, kNaN, kInfinity}) {
    EXPECT_THROW(Anchor({.speed_m_s = bad}), UsageError);
    EXPECT_THROW(Anchor({.hand_share = bad}), UsageError);
    EXPECT_THROW(Anchor({.most_share_m_s = bad}), UsageError);
  }
}

}  // namespace
}  // namespace filiform
