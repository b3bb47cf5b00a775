#include "device/falcon/falcon.h"

#include "tests/support/fake_falcon.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::FakeFalcon;
using test::FakeUsb;
using test::FakeUsbFault;

std::string writeImage(const test::TempFolder& folder, std::size_t bytes = 7914) {
  const std::string path = folder.file("image.bin");
  std::ofstream file(path, std::ios::binary);
  for (std::size_t i = 0; i < bytes; ++i) file.put(static_cast<char>(i * i % 251));
  return path;
}

Wrench push(const Vector3d& force_N) {
  Wrench wrench;
  wrench.force_N = force_N;
  return wrench;
}

// A device with firmware, and a driver that has opened it.
struct Bench {
  explicit Bench(bool homed = true, FalconOptions options = {}) : falcon(usb, std::move(options)) {
    fake.powerUp(true);
    falcon.open();
    if (!homed) return;
    falcon.exchange({});
    fake.home();
    falcon.exchange({});
    EXPECT_EQ(falcon.status(), DeviceStatus::ready);
  }
  DeviceState repeat(int times, const Wrench& wrench = {}) {
    DeviceState state;
    for (int i = 0; i < times; ++i) state = falcon.exchange(wrench);
    return state;
  }
  // Runs until the force ramp has ended.
  DeviceState settle(const Wrench& wrench = {}) { return repeat(700, wrench); }

  FakeUsb usb;
  FakeFalcon fake{usb};
  Falcon falcon;
};

std::string failureOf(const std::function<void()>& what) {
  try {
    what();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return {};
}

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Falcon, SaysWhatIsMissing) {
  const test::TempFolder folder;
  FakeUsb usb;
  Falcon falcon(usb);
  const auto open = [&] { falcon.open(); };
  EXPECT_TRUE(holds(failureOf(open), "no Novint Falcon"));
  EXPECT_EQ(falcon.status(), DeviceStatus::closed);
  FakeFalcon fake(usb);
  fake.usb_device().permitted = false;
  EXPECT_TRUE(holds(failureOf(open), kUdevRule));
  fake.usb_device().permitted = true;
  const std::string no_firmware = failureOf(open);
  EXPECT_TRUE(holds(no_firmware, kFalconFirmwareVariable)) << no_firmware;
  EXPECT_TRUE(holds(no_firmware, "--device falcon:FILE")) << no_firmware;
  EXPECT_EQ(falcon.status(), DeviceStatus::closed);

  const std::string nowhere = folder.file("none.bin");
  EXPECT_TRUE(holds(failureOf([&] { Falcon(usb, {.firmware = nowhere}).open(); }), nowhere));
  for (const std::size_t bytes : {std::size_t{0}, kFalconFirmwareLeast - 1, kFalconFirmwareMost + 1}) {
    const std::string path = writeImage(folder, bytes);
    EXPECT_TRUE(holds(failureOf([&] { Falcon(usb, {.firmware = path}).open(); }), "not Falcon firmware")) << bytes;
  }
  EXPECT_TRUE(fake.image.empty());
  EXPECT_TRUE(usb.violations().empty()) << usb.violations().front();
}

TEST(Falcon, LoadsTheFirmwareThatItIsGiven) {
  const test::TempFolder folder;
  for (const bool by_environment : {false, true}) {
    FakeUsb usb;
    FakeFalcon fake(usb);
    const std::string path = writeImage(folder);
    if (by_environment) setenv(kFalconFirmwareVariable, path.c_str(), 1);
    Falcon falcon(usb, {.firmware = by_environment ? "" : path});
    unsetenv(kFalconFirmwareVariable);
    falcon.open();
    EXPECT_EQ(falcon.status(), DeviceStatus::homing);
    EXPECT_TRUE(fake.running);
    std::ifstream file(path, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    EXPECT_EQ(fake.image, bytes);
    EXPECT_LT(usb.time_s(), 3);
    // The second time the firmware runs already and is not loaded.
    falcon.close();
    const double closed_s = usb.time_s();
    Falcon again(usb);
    again.open();
    EXPECT_LT(usb.time_s() - closed_s, 0.1);
    EXPECT_TRUE(usb.violations().empty()) << usb.violations().front();
  }
}

TEST(Falcon, AWrongEchoIsTriedAgainAndGivenUpInTheEnd) {
  const test::TempFolder folder;
  const std::string path = writeImage(folder);
  for (const std::size_t at : {std::size_t{0}, std::size_t{61}, std::size_t{62}, std::size_t{7913}}) {
    FakeUsb usb;
    FakeFalcon fake(usb);
    fake.wrong_echo = at;
    Falcon falcon(usb, {.firmware = path});
    falcon.open();
    EXPECT_EQ(falcon.status(), DeviceStatus::homing) << at;
    EXPECT_EQ(fake.image.size(), 7914u);
    EXPECT_TRUE(usb.violations().empty()) << usb.violations().front();
  }
  FakeUsb usb;
  FakeFalcon fake(usb);
  fake.wrong_echo = 100;
  fake.bad_attempts = 1000;
  Falcon falcon(usb, {.firmware = path});
  const std::string why = failureOf([&] { falcon.open(); });
  EXPECT_TRUE(holds(why, "5 attempts")) << why;
  EXPECT_TRUE(holds(why, "byte 100")) << why;
  EXPECT_EQ(falcon.status(), DeviceStatus::closed);
}

TEST(Falcon, FirmwareThatDoesNotAnswerIsNamed) {
  const test::TempFolder folder;
  FakeUsb usb;
  FakeFalcon fake(usb);
  fake.mute = true;
  const std::string path = writeImage(folder);
  Falcon falcon(usb, {.firmware = path});
  const std::string why = failureOf([&] { falcon.open(); });
  EXPECT_TRUE(holds(why, path)) << why;
  EXPECT_TRUE(holds(why, "does not answer")) << why;
}

TEST(Falcon, ThereIsNoForceBeforeHomingAndNoSpeedFromTheJumpOfTheCounts) {
  Bench bench(false);
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
  Bench bench;
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
void moveTo(Bench& bench, const Vector3d& p_D, const Wrench& wrench = {}) {
  const Vector3d from_D = bench.fake.p_D;
  const int steps = 1 + static_cast<int>((p_D - from_D).norm() / 2e-4);
  for (int i = 1; i <= steps; ++i) {
    bench.fake.p_D = from_D + (p_D - from_D) * i / steps;
    bench.falcon.exchange(wrench);
  }
}

TEST(Falcon, RendersTheForceAndSeesTheGripAllOverTheWorkspace) {
  Bench bench;
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
  Bench bench;
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
  Bench bench;
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
  Bench bench;
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
        Bench bench;
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
  Bench bench;
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
    Bench bench;
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
  Bench bench;
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
  Bench bench(false);
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
    Bench bench;
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

TEST(Falcon, SaysWhatForceItSentAfterItsOwnLimits) {
  Bench bench;
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

TEST(Falcon, FailedAndStalledTransfersAreSurvived) {
  for (const auto kind : {FakeUsbFault::Kind::failed, FakeUsbFault::Kind::stalled})
    for (std::uint64_t ahead = 0; ahead < 6; ++ahead) {
      Bench bench;
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
  const std::string path = writeImage(folder, 4096);
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
  Bench bench;
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
  Bench bench;
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

TEST(Falcon, TwoDevicesAreToldApartByTheirSockets) {
  FakeUsb usb;
  FakeFalcon left(usb, "1-1"), right(usb, "1-2");
  left.powerUp(true);
  right.powerUp(true);
  Falcon falcon(usb, {.bus_path = "1-2"});
  falcon.open();
  falcon.exchange({});
  EXPECT_TRUE(left.received().empty());
  EXPECT_FALSE(right.received().empty());
  Falcon other(usb);
  other.open();
  EXPECT_FALSE(left.received().empty());
  EXPECT_TRUE(holds(failureOf([&] { Falcon(usb, {.bus_path = "9-9"}).open(); }), "9-9"));
  EXPECT_TRUE(holds(failureOf([&] { Falcon(usb, {.bus_path = "1-2"}).open(); }), "another program"));
}

TEST(Falcon, TheBridgeIsAskedToHandReportsOnAtOnceOnlyIfWanted) {
  for (const bool wanted : {false, true}) {
    FakeUsb usb;
    FakeFalcon fake(usb);
    fake.powerUp(true);
    int asked = 0;
    const auto handled = fake.usb_device().on_control;
    fake.usb_device().on_control = [&](const UsbSetup& setup, std::span<std::uint8_t> data,
                                       test::FakeUsbDevice& device) {
      asked += setup.request == ftdi::kEventAtReportEnd.request && setup.value == ftdi::kEventAtReportEnd.value;
      return handled(setup, data, device);
    };
    Falcon falcon(usb, {.event_character = wanted});
    falcon.open();
    EXPECT_EQ(asked, wanted ? 1 : 0);
  }
}

TEST(Falcon, AnExchangeNeitherAllocatesNorLocks) {
  std::vector<std::uint8_t> answer;  // outlives the driver, which sends zero when destroyed
  Bench bench;
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
