// A Falcon that fails: bad packets, silence, failed transfers, unplugging. Each ends in a zero force.
#include "device/falcon/falcon.h"
#include "tests/support/devices/falcon_bench.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::FakeFalcon;
using test::FakeUsb;
using test::FakeUsbFault;
using test::FalconBench;
using test::push;
using test::writeImage;

TEST(Falcon, OneBadPacketNeverMovesTheProxyNorEndsTheSession) {
  struct Case {
    FakeUsbFault::Kind kind;
    std::size_t bytes;
  };
  using Kind = FakeUsbFault::Kind;
  std::vector<Case> cases{{Kind::lost, 0}, {Kind::merged, 0}, {Kind::garbage, 0}};
  for (std::size_t bytes = 0; bytes <= 18; ++bytes) cases.push_back({Kind::truncated, bytes});
  for (std::size_t bytes = 1; bytes < 18; ++bytes) cases.push_back({Kind::split, bytes});
  for (const bool sends_status : {false, true})
    for (const Case& one : cases)
      for (std::uint64_t ahead : {0u, 1u, 2u}) {
        FalconBench bench;
        bench.fake.sends_status = sends_status;
        bench.fake.p_D = Vector3d(1e-3, 2e-3, -3e-3);
        bench.settle(push({1, 1, 1}));
        ASSERT_FALSE(bench.fake.last().isZero());
        bench.fake.usb_device().fault(
            {.kind = one.kind, .at = bench.fake.usb_device().packets() + ahead, .bytes = one.bytes, .seed = ahead + 7});
        for (int i = 0; i < 60; ++i) {
          const DeviceState state = bench.falcon.exchange(push({1, 1, 1}));
          ASSERT_EQ(state.status, DeviceStatus::ready);
          ASSERT_LT((state.p_D - bench.fake.p_D).norm(), 1e-4);
          ASSERT_LT(state.v_D.norm(), 0.01);
          ASSERT_EQ(state.buttons, 0u);
        }
        ASSERT_LT((bench.fake.force_N() - Vector3d(1, 1, 1)).norm(), 0.05);
        bench.falcon.close();
        ASSERT_TRUE(bench.fake.last().isZero());
        ASSERT_TRUE(bench.usb.violations().empty()) << bench.usb.violations().front();
      }
}

TEST(Falcon, ALostAnswerDoesNotMakeEveryLaterOneOld) {
  FalconBench bench;
  bench.settle();
  bench.fake.usb_device().fault({.kind = FakeUsbFault::Kind::lost, .at = bench.fake.usb_device().packets()});
  bench.repeat(2);
  EXPECT_EQ(bench.falcon.counters().unanswered, 1u);
  // Later than the driver waits, then in time again.
  bench.fake.report_delay_s = 0.007;
  bench.repeat(1);
  bench.fake.report_delay_s = 1e-3;
  bench.repeat(5);
  for (int i = 1; i <= 20; ++i) {
    bench.fake.p_D.x() = 1e-3 * i;
    EXPECT_NEAR(bench.repeat(1).p_D.x(), 1e-3 * i, 6e-5);
  }
}

TEST(Falcon, SilenceTakesTheForceAtOnceAndIsAFaultAfterAWhile) {
  for (std::uint64_t ahead = 0; ahead < 4; ++ahead) {
    FalconBench bench;
    bench.settle(push({2, 0, 0}));
    bench.fake.usb_device().fault(
        {.kind = FakeUsbFault::Kind::silent, .at = bench.fake.usb_device().packets() + ahead});
    const double silent_s = bench.usb.time_s();
    double zero_s = 0;
    DeviceState state;
    for (int i = 0; i < 1000 && state.status != DeviceStatus::fault; ++i) {
      state = bench.falcon.exchange(push({2, 0, 0}));
      if (zero_s == 0 && bench.fake.last().isZero()) zero_s = bench.usb.time_s();
      if (zero_s > 0) {
        EXPECT_TRUE(bench.fake.last().isZero());
      }
    }
    EXPECT_EQ(state.status, DeviceStatus::fault);
    EXPECT_LT(zero_s - silent_s, 0.02 + 0.002 * static_cast<double>(ahead));
    EXPECT_NEAR(bench.usb.time_s() - silent_s, Falcon::kLost_s, 0.05);
    EXPECT_TRUE(bench.fake.last().red);
    EXPECT_LT((state.p_D - bench.fake.p_D).norm(), 1e-4);
    EXPECT_EQ(state.v_D, Vector3d::Zero());
    EXPECT_EQ(bench.falcon.exchange(push({2, 0, 0})).status, DeviceStatus::fault);
    EXPECT_TRUE(bench.fake.last().isZero());
  }
}

TEST(Falcon, AGapInTheReportsBeginsTheRampAnew) {
  FalconBench bench;
  bench.settle(push({2, 0, 0}));
  bench.fake.mute = true;
  bench.repeat(10, push({2, 0, 0}));
  bench.fake.mute = false;
  bench.repeat(3, push({2, 0, 0}));
  EXPECT_EQ(bench.falcon.status(), DeviceStatus::ready);
  EXPECT_LT(bench.fake.force_N().norm(), 0.1);
  bench.settle(push({2, 0, 0}));
  EXPECT_NEAR(bench.fake.force_N().norm(), 2, 0.02);
}

TEST(Falcon, AHostThatPausesHasNotLostTheDeviceAndBeginsWithoutForce) {
  FalconBench bench(false);
  bench.usb.pause(5);  // between open() and the first exchange
  bench.repeat(2);
  EXPECT_EQ(bench.falcon.status(), DeviceStatus::homing);
  bench.fake.home();
  bench.settle(push({2, 0, 0}));
  EXPECT_NEAR(bench.fake.force_N().norm(), 2, 0.02);
  bench.usb.pause(1);
  DeviceState state = bench.repeat(1, push({2, 0, 0}));
  EXPECT_EQ(state.status, DeviceStatus::ready);
  EXPECT_TRUE(bench.fake.last().isZero());
  bench.repeat(3, push({2, 0, 0}));
  EXPECT_LT(bench.fake.force_N().norm(), 0.1);
  state = bench.settle(push({2, 0, 0}));
  EXPECT_EQ(state.status, DeviceStatus::ready);
  EXPECT_NEAR(bench.fake.force_N().norm(), 2, 0.02);
}

TEST(Falcon, ADeviceThatTakesNothingIsAFaultAndHoldsUpNobody) {
  for (const auto kind : {FakeUsbFault::Kind::deaf, FakeUsbFault::Kind::stuck, FakeUsbFault::Kind::silent}) {
    FalconBench bench;
    bench.settle(push({2, 0, 0}));
    test::FakeUsbDevice& device = bench.fake.usb_device();
    const bool silent = kind == FakeUsbFault::Kind::silent;
    device.fault({.kind = kind, .at = silent ? device.packets() : device.transfers()});
    DeviceState state;
    for (int i = 0; i < 1000 && bench.falcon.status() != DeviceStatus::fault; ++i) {
      const double begin_s = bench.usb.time_s();
      state = bench.falcon.exchange(push({2, 0, 0}));
      EXPECT_LE(bench.usb.time_s() - begin_s, Falcon::kAnswerTime_s + 1e-9) << i;
    }
    EXPECT_EQ(bench.falcon.status(), DeviceStatus::fault);
    // A zero that the device did not take is not reported as sent.
    EXPECT_NEAR(bench.fake.force_N().norm(), silent ? 0 : 2, 0.02);
    EXPECT_LT((*state.sent_N - bench.fake.force_N()).norm(), 0.02);
    EXPECT_LT((*bench.falcon.exchange({}).sent_N - bench.fake.force_N()).norm(), 0.02);
    bench.falcon.close();
    EXPECT_TRUE(bench.usb.violations().empty()) << bench.usb.violations().front();
  }
}

TEST(Falcon, FailedAndStalledTransfersAreSurvived) {
  for (const auto kind : {FakeUsbFault::Kind::failed, FakeUsbFault::Kind::stalled})
    for (std::uint64_t ahead = 0; ahead < 6; ++ahead) {
      FalconBench bench;
      bench.settle(push({2, 0, 0}));
      bench.fake.usb_device().fault({.kind = kind, .at = bench.fake.usb_device().transfers() + ahead});
      bench.repeat(50, push({2, 0, 0}));
      EXPECT_EQ(bench.falcon.status(), DeviceStatus::ready);
      EXPECT_EQ(bench.falcon.counters().transfer_errors, 1u) << toString(DeviceStatus::ready) << ahead;
      bench.falcon.close();
      EXPECT_TRUE(bench.fake.last().isZero());
      EXPECT_TRUE(bench.usb.violations().empty()) << bench.usb.violations().front();
    }
}

TEST(Falcon, UnpluggedAtAnyTransferItEndsInFaultOrWithAnErrorAndCanBeOpenedAgain) {
  const test::TempFolder folder;
  const std::string path = writeImage(folder.file("image.bin"), 4096);
  const auto session = [&](FakeUsb& usb, FakeFalcon& fake, std::uint64_t unplugged_at) {
    fake.image_bytes = 4096;
    fake.usb_device().fault({.kind = FakeUsbFault::Kind::unplugged, .at = unplugged_at});
    Falcon falcon(usb, {.firmware = path});
    try {
      falcon.open();
    } catch (const DeviceError&) {
      EXPECT_EQ(falcon.status(), DeviceStatus::closed);
      return fake.usb_device().transfers();
    }
    falcon.exchange({});
    if (fake.running && fake.usb_device().plugged()) fake.home();
    for (int i = 0; i < 50; ++i) {
      const DeviceState state = falcon.exchange(push({1, 0, 0}));
      EXPECT_TRUE(state.p_D.allFinite() && state.v_D.allFinite());
      if (!fake.usb_device().plugged()) {
        EXPECT_EQ(state.status, DeviceStatus::fault);
      }
    }
    EXPECT_EQ(falcon.status(), fake.usb_device().plugged() ? DeviceStatus::ready : DeviceStatus::fault);
    falcon.close();
    return fake.usb_device().transfers();
  };
  FakeUsb whole;
  FakeFalcon good(whole);
  const std::uint64_t transfers = session(whole, good, UINT64_MAX);
  ASSERT_TRUE(good.homed());
  ASSERT_GT(transfers, 200u);
  const std::uint64_t stride = test::kSanitized ? 7 : 1;
  for (std::uint64_t k = 0; k < transfers; k += stride) {
    FakeUsb usb;
    FakeFalcon fake(usb);
    session(usb, fake, k);
    ASSERT_FALSE(fake.usb_device().plugged()) << k;
    ASSERT_TRUE(usb.violations().empty()) << k << ": " << usb.violations().front();
    ASSERT_EQ(fake.forces_before_homing(), 0u);
    if (k % 16 != 0) continue;
    FakeFalcon back(usb);
    back.powerUp(true);
    Falcon again(usb);
    again.open();
    ASSERT_EQ(again.status(), DeviceStatus::homing);
  }
}

TEST(Falcon, ReportsOfAPlaceWhereTheGripCannotBeAreRefused) {
  FalconBench bench;
  const DeviceState before = bench.settle(push({0, 1, 0}));
  // Flipped bits on the line may leave a report well-formed.
  const auto counts = falconCountsOfAngles(falconAngles(kFalconCentre_F).value());
  for (const std::int16_t jump : {4096, -4096, 512, 30000}) {
    bench.fake.counts = counts;
    (*bench.fake.counts)[1] = static_cast<std::int16_t>(counts[1] + jump);
    const DeviceState state = bench.repeat(2, push({0, 1, 0}));
    EXPECT_EQ(state.p_D, before.p_D) << jump;
    EXPECT_LT(state.v_D.norm(), 1e-9);
    bench.fake.counts.reset();
    bench.repeat(10, push({0, 1, 0}));
  }
  EXPECT_EQ(bench.falcon.counters().refused_reports, 8u);
  // Five consistent reports in a row are accepted. The driver then starts as after homing: at rest and without force.
  bench.fake.p_D = Vector3d(0.02, 0, 0);
  DeviceState state = bench.repeat(Falcon::kBelieved - 1, push({0, 1, 0}));
  EXPECT_EQ(state.p_D, before.p_D);
  state = bench.repeat(2, push({0, 1, 0}));
  EXPECT_LT((state.p_D - bench.fake.p_D).norm(), 6e-5);
  EXPECT_EQ(state.v_D, Vector3d::Zero());
  EXPECT_LT(bench.fake.force_N().norm(), 0.05);
}

TEST(Falcon, ADeviceThatForgetsItsHomingIsHomedAgain) {
  FalconBench bench;
  bench.settle(push({0, 1, 0}));
  bench.fake.powerUp(true);
  DeviceState state = bench.repeat(5, push({0, 1, 0}));
  EXPECT_EQ(state.status, DeviceStatus::homing);
  EXPECT_TRUE(bench.fake.last().isZero());
  EXPECT_TRUE(bench.fake.last().homing);
  bench.fake.home();
  state = bench.repeat(3, push({0, 1, 0}));
  EXPECT_EQ(state.status, DeviceStatus::ready);
  EXPECT_LT(bench.fake.force_N().norm(), 0.05);
}

}  // namespace
}  // namespace filiform
