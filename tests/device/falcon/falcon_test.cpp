// A Falcon that works: homing, forces, positions, closing.
#include "device/falcon/falcon.h"

#include "tests/support/devices/falcon_bench.h"
#include "tests/support/no_alloc_guard.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::FakeFalcon;
using test::FakeUsb;
using test::FalconBench;
using test::push;

TEST(Falcon, ThereIsNoForceBeforeHomingAndNoSpeedFromTheJumpOfTheCounts) {
  FalconBench bench(false);
  bench.fake.p_D = Vector3d(0.02, -0.03, 0.01);
  DeviceState state = bench.repeat(300, push({5, 5, 5}));
  EXPECT_EQ(state.status, DeviceStatus::homing);
  EXPECT_EQ(state.p_D, Vector3d::Zero());
  EXPECT_TRUE(bench.fake.last().homing);
  EXPECT_TRUE(bench.fake.last().red);
  bench.fake.home();
  double fastest_m_s = 0;
  for (int i = 0; i < 300; ++i) {
    state = bench.falcon.exchange(push({5, 5, 5}));
    EXPECT_EQ(state.status, DeviceStatus::ready);
    EXPECT_LT((state.p_D - bench.fake.p_D).norm(), 5e-5);
    fastest_m_s = std::max(fastest_m_s, state.v_D.norm());
  }
  EXPECT_LT(fastest_m_s, 1e-6);
  EXPECT_EQ(bench.fake.forces_before_homing(), 0u);
  EXPECT_FALSE(bench.fake.last().homing);
  EXPECT_FALSE(bench.fake.last().red);
  EXPECT_TRUE(bench.fake.last().green);
}

TEST(Falcon, TheForceGrowsFromZeroOverTheRamp) {
  FalconBench bench;
  const double begin_s = bench.usb.time_s();
  double last_N = 0;
  for (int i = 0; i < 600; ++i) {
    bench.falcon.exchange(push({0, 0, 4}));
    const double now_N = bench.fake.force_N().z();
    EXPECT_LE(now_N, 4 * (bench.usb.time_s() - begin_s + 0.002) / 0.5 + 0.05);
    EXPECT_GE(now_N, last_N - 0.02);
    last_N = now_N;
  }
  EXPECT_NEAR(last_N, 4, 0.02);
}

// Moves the grip to p_D at 0.2 m/s.
void moveTo(FalconBench& bench, const Vector3d& p_D, const Wrench& wrench = {}) {
  const Vector3d from_D = bench.fake.p_D;
  const int steps = 1 + static_cast<int>((p_D - from_D).norm() / 2e-4);
  for (int i = 1; i <= steps; ++i) {
    bench.fake.p_D = from_D + (p_D - from_D) * i / steps;
    bench.falcon.exchange(wrench);
  }
}

TEST(Falcon, RendersTheForceAndSeesTheGripAllOverTheWorkspace) {
  FalconBench bench;
  bench.settle();
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d p_D(corner & 1 ? 0.039 : -0.039, corner & 2 ? 0.039 : -0.039, corner & 4 ? 0.039 : -0.039);
    moveTo(bench, p_D);
    for (const Vector3d& force_N : {Vector3d(1, 0, 0), Vector3d(0, -1, 0), Vector3d(0, 0, 1), Vector3d(2, -1, 0.5)}) {
      const DeviceState state = bench.repeat(3, push(force_N));
      EXPECT_LT((state.p_D - p_D).norm(), 1.2e-4) << corner;
      EXPECT_LT((bench.fake.force_N() - force_N).norm(), 0.03) << corner << ": " << force_N.transpose();
    }
  }
  EXPECT_EQ(bench.falcon.counters().refused_reports, 0u);
}

TEST(Falcon, StrongForcesSaturateInTheirDirectionAndBadOnesAreZero) {
  FalconBench bench;
  bench.settle();
  const Vector3d direction = Vector3d(1, 2, -2).normalized();
  for (const double force_N : {20.0, 1e6, 1e300}) {
    bench.repeat(2, push(force_N * direction));
    EXPECT_LT((bench.fake.force_N() - 8 * direction).norm(), 0.05) << force_N;
  }
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    bench.repeat(2, push({1, bad, 0}));
    EXPECT_TRUE(bench.fake.last().isZero());
    bench.repeat(1, push({1, 0, 0}));
    EXPECT_FALSE(bench.fake.last().isZero());
  }
}

TEST(Falcon, TheVelocityFollowsTheHandWithinAWindow) {
  FalconBench bench;
  bench.settle();
  moveTo(bench, {-0.03, 0, 0});
  DeviceState state;
  double last_s = bench.usb.time_s(), worst_m_s = 0;
  for (int i = 0; bench.fake.p_D.x() < 0.03; ++i) {
    const double now_s = bench.usb.time_s();
    bench.fake.p_D.x() += 0.3 * (now_s - last_s);
    last_s = now_s;
    state = bench.falcon.exchange({});
    if (i > 20) worst_m_s = std::max(worst_m_s, (state.v_D - Vector3d(0.3, 0, 0)).norm());
  }
  EXPECT_LT(worst_m_s, 0.012);  // two counts in 12 ms
  state = bench.repeat(20);
  EXPECT_LT(state.v_D.norm(), 1e-9);
}

TEST(Falcon, ButtonsArePassedOn) {
  FalconBench bench;
  for (const std::uint8_t buttons : {1, 2, 4, 8, 15, 0}) {
    bench.fake.buttons = buttons;
    EXPECT_EQ(bench.repeat(1).buttons, buttons);
  }
  EXPECT_EQ(bench.falcon.capabilities().buttons, 4);
}

TEST(Falcon, ClosingSendsZeroSeveralTimes) {
  for (const bool destroyed : {false, true}) {
    FakeUsb usb;
    FakeFalcon fake(usb);
    fake.powerUp(true);
    {
      Falcon falcon(usb);
      falcon.open();
      falcon.exchange({});
      fake.home();
      for (int i = 0; i < 700; ++i) falcon.exchange(push({1, 2, 3}));
      ASSERT_FALSE(fake.last().isZero());
      if (!destroyed) {
        falcon.close();
        falcon.close();
        EXPECT_EQ(falcon.exchange(push({1, 2, 3})).status, DeviceStatus::closed);
      }
    }
    const auto& received = fake.received();
    for (std::size_t i = received.size() - Falcon::kZeroPackets; i < received.size(); ++i) {
      EXPECT_TRUE(received[i].isZero());
      EXPECT_FALSE(received[i].red || received[i].green || received[i].homing);
    }
    EXPECT_TRUE(usb.violations().empty()) << usb.violations().front();
    EXPECT_TRUE(fake.usb_device().claimed().empty());
  }
}

TEST(Falcon, SaysWhatForceItSentAfterItsOwnLimits) {
  FalconBench bench;
  const auto check = [&](const Vector3d& force_N) {
    const DeviceState state = bench.repeat(1, push(force_N));
    ASSERT_TRUE(state.sent_N.has_value());
    EXPECT_LT((*state.sent_N - bench.fake.force_N()).norm(), 0.02)
        << state.sent_N->transpose() << ", at the motors " << bench.fake.force_N().transpose();
  };
  for (int i = 0; i < 100; ++i) check({2, 0, 0});  // the ramp
  bench.settle(push({2, 0, 0}));
  for (const Vector3d& force_N : {Vector3d(2, 0, 0), Vector3d(0, 30, 0), Vector3d(0, 0, -1)}) check(force_N);
  check({std::numeric_limits<double>::quiet_NaN(), 0, 0});
  bench.fake.mute = true;
  bench.repeat(10, push({2, 0, 0}));  // longer than kStale_s
  EXPECT_EQ(*bench.repeat(1, push({2, 0, 0})).sent_N, Vector3d::Zero());
  bench.fake.mute = false;
  for (int i = 0; i < 10; ++i) check({2, 0, 0});
}

TEST(Falcon, AnExchangeNeitherAllocatesNorLocks) {
  std::vector<std::uint8_t> answer;  // outlives the driver, which sends zero when destroyed
  FalconBench bench;
  bench.settle(push({1, 2, 3}));
  // The fake allocates for what it receives. Without that, only the driver's allocations remain.
  {
    auto connection_bytes = packFalconCommand({});
    answer = {0x01, 0x60};
    answer.insert(answer.end(), connection_bytes.begin(), connection_bytes.end());
    const auto counts = falconCountsOfAngles(falconAngles(kFalconCentre_F).value());
    FalconCommand same;
    same.motors = counts;
    const FalconPacket report = packFalconCommand(same);  // numbers have the same encoding in both directions
    std::copy(report.begin(), report.end(), answer.begin() + 2);
    answer[2 + 13] = 'A' + 0x70;
  }
  bench.fake.usb_device().on_write = [&answer](std::uint8_t, std::span<const std::uint8_t>,
                                               test::FakeUsbDevice& device) { device.answer(0x81, answer, 1e-3); };
  bench.falcon.exchange(push({1, 2, 3}));
  const std::uint64_t before = bench.falcon.counters().reports;
  test::NoAllocGuard guard;
  for (int i = 0; i < 20; ++i) bench.falcon.exchange(push({1, 2, 3}));
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0u) << calls.first;
  EXPECT_EQ(bench.falcon.counters().reports, before + 20);
  EXPECT_EQ(bench.falcon.status(), DeviceStatus::ready);
}

}  // namespace
}  // namespace filiform
