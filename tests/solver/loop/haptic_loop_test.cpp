#include "solver/loop/haptic_loop.h"

#include "device/simulated/null_device.h"
#include "device/simulated/simulated_hand.h"
#include "index/errors.h"
#include "tests/support/devices/haptic_loops.h"
#include "tests/support/sanitized.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <pthread.h>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using test::push;
using test::quietLoop;
using test::soon;

// A device that a test can watch and change while the loop runs.
class WatchedDevice : public HapticDevice {
 public:
  explicit WatchedDevice(bool paces = false) { capabilities_.paces_loop = paces; }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return status_; }
  void open() override {}
  void close() noexcept override {}
  DeviceState exchange(const Wrench& wrench) noexcept override {
    if (capabilities_.paces_loop) std::this_thread::sleep_for(1ms);
    if (last_force_N == 0) rose_to_N = wrench.force_N.x();
    last_force_N = wrench.force_N.x();
    ++exchanges;
    DeviceState state;
    if (!frozen) ++periods_;
    state.time_s = 0.001 * periods_;
    state.status = status_;
    return state;
  }
  void setStatus(DeviceStatus status) { status_ = status; }

  std::atomic<double> last_force_N{0}, rose_to_N{0};  // rose_to_N: the first force after zero
  std::atomic<int> exchanges{0};
  std::atomic<bool> frozen{false};

 private:
  DeviceCapabilities capabilities_;
  std::atomic<DeviceStatus> status_{DeviceStatus::ready};
  int periods_ = 0;
};

// Without the guard: on a busy machine it would interrupt so often that the force might never be whole.
HapticLoopOptions unguarded() {
  HapticLoopOptions options = quietLoop();
  options.stall_s = 0;
  return options;
}

TEST(HapticLoop, TicksAndSendsZeroForceAtStop) {
  WatchedDevice device;
  std::atomic<int> ticks{0};
  HapticLoop loop(device, [&](const DeviceState&, double dt_s) {
    EXPECT_GT(dt_s, 0);
    ++ticks;
    return push(1);
  });
  loop.start();
  ASSERT_TRUE(loop.running());
  ASSERT_TRUE(soon([&] { return ticks > 100 && device.last_force_N == 1; }));
  loop.stop();
  EXPECT_FALSE(loop.running());
  EXPECT_EQ(device.last_force_N, 0);
  EXPECT_EQ(static_cast<std::uint64_t>(device.exchanges),
            static_cast<std::uint64_t>(ticks) + 1 + loop.guard_exchanges());
  EXPECT_EQ(loop.metrics().ticks(), static_cast<std::uint64_t>(ticks));
  EXPECT_EQ(loop.metrics().exchange().count(), loop.metrics().ticks());
  EXPECT_EQ(loop.fault(), "");
  for (const std::string& refusal : loop.refusals()) EXPECT_NE(refusal.find("may delay"), std::string::npos) << refusal;
}

TEST(HapticLoop, RunsASimulatedHandAndANullDevice) {
  SimulatedHand hand({});
  NullDevice null;
  for (HapticDevice* device : {static_cast<HapticDevice*>(&hand), static_cast<HapticDevice*>(&null)}) {
    device->open();
    std::atomic<int> ready{0};
    HapticLoop loop(
        *device,
        [&](const DeviceState& state, double dt_s) {
          ready += state.status == DeviceStatus::ready;
          EXPECT_NEAR(dt_s, 0.001, 1e-9);
          return push(0.5);
        },
        unguarded());  // an exchange of the guard would take a period of the null device's time
    loop.start();
    EXPECT_TRUE(soon([&] { return ready > 20; }));
    loop.stop();
    device->close();
  }
  EXPECT_EQ(null.lastWrench().force_N, Eigen::Vector3d::Zero());
}

TEST(HapticLoop, IsPacedByADeviceThatPaces) {
  WatchedDevice device(true);
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, quietLoop());
  loop.start();
  ASSERT_TRUE(soon([&] { return loop.ticks() > 20; }));
  loop.stop();
  EXPECT_EQ(loop.metrics().wake().max_ns(), 0);
  EXPECT_GE(loop.metrics().exchange().percentile_ns(0.5), 1'000'000);
  EXPECT_EQ(device.last_force_N, 0);
}

TEST(HapticLoop, ExceptionInTheTickEndsItWithZeroForce) {
  WatchedDevice device;
  int ticks = 0;
  HapticLoop loop(
      device,
      [&](const DeviceState&, double) -> Wrench {
        if (++ticks > 10) throw std::runtime_error("no");
        return push(1);
      },
      quietLoop());
  loop.start();
  ASSERT_TRUE(soon([&] { return !loop.running(); }));
  EXPECT_EQ(device.last_force_N, 0);
  EXPECT_NE(loop.fault(), "");
  loop.stop();
}

TEST(HapticLoop, FaultOfTheDeviceEndsItWithZeroForceAndItCanStartAgain) {
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, unguarded());
  loop.start();
  ASSERT_TRUE(soon([&] { return device.last_force_N == 1; }));
  device.setStatus(DeviceStatus::fault);
  ASSERT_TRUE(soon([&] { return !loop.running(); }));
  EXPECT_EQ(device.last_force_N, 0);
  EXPECT_NE(loop.fault().find("device"), std::string::npos);
  device.setStatus(DeviceStatus::ready);
  loop.start();
  EXPECT_EQ(loop.fault(), "");
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}  // the destructor stops it

TEST(HapticLoop, SendsNoForceBeforeTheDeviceIsReady) {
  WatchedDevice device;
  device.setStatus(DeviceStatus::homing);
  std::atomic<int> ticks{0};
  HapticLoop loop(
      device,
      [&](const DeviceState&, double) {
        ++ticks;
        return push(1);
      },
      unguarded());
  loop.start();
  ASSERT_TRUE(soon([&] { return ticks > 20; }));
  EXPECT_EQ(device.last_force_N, 0);
  device.setStatus(DeviceStatus::ready);
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}

TEST(HapticLoop, WatchdogTakesTheForceFromADeviceThatStandsStill) {
  WatchedDevice device;
  HapticLoopOptions options = unguarded();
  options.watchdog_s = 0.02;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, options);
  loop.start();
  ASSERT_TRUE(soon([&] { return device.last_force_N == 1; }));
  device.frozen = true;
  ASSERT_TRUE(soon([&] { return device.last_force_N == 0; }));
  EXPECT_GT(loop.stale_ticks(), 0u);
  device.frozen = false;
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}

TEST(HapticLoop, AForceThatIsWithheldIsZeroAndComesBackByTheRamp) {
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, unguarded());
  loop.start();
  ASSERT_TRUE(soon([&] { return device.last_force_N == 1; }));
  loop.withhold(true);
  ASSERT_TRUE(soon([&] { return device.last_force_N == 0; }));
  const int exchanges = device.exchanges;
  ASSERT_TRUE(soon([&] { return device.exchanges > exchanges + 20; }));
  EXPECT_EQ(device.last_force_N, 0);
  loop.withhold(false);
  ASSERT_TRUE(soon([&] { return device.last_force_N > 0; }));
  EXPECT_LT(device.rose_to_N, 0.9);
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}

TEST(HapticLoop, SendsZeroForAForceThatIsNotFinite) {
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(std::numeric_limits<double>::quiet_NaN()); }, quietLoop());
  loop.start();
  ASSERT_TRUE(soon([&] { return loop.ticks() > 10; }));
  EXPECT_EQ(device.last_force_N, 0);
}

TEST(HapticLoop, CountsTicksThatOverrunAsMissedDeadlinesAndSkipsThem) {
  WatchedDevice device;
  HapticLoop loop(
      device,
      [](const DeviceState&, double) {
        std::this_thread::sleep_for(5ms);
        return Wrench{};
      },
      quietLoop());
  loop.start();
  ASSERT_TRUE(soon([&] { return loop.ticks() >= 5; }));
  loop.stop();
  EXPECT_EQ(loop.metrics().missed_deadlines(), loop.metrics().ticks());
}

TEST(HapticLoop, ReportsTheSentForceToTheTick) {
  WatchedDevice device;
  std::atomic<bool> withheld_seen{false}, whole_seen{false};
  HapticLoop loop(
      device,
      [&](const DeviceState& state, double) {
        if (state.sent_N && state.sent_N->x() == 1) whole_seen = true;
        if (whole_seen && state.sent_N && state.sent_N->isZero(0)) withheld_seen = true;
        return push(1);
      },
      unguarded());
  loop.start();
  EXPECT_TRUE(soon([&] { return whole_seen.load(); }));
  loop.withhold(true);
  EXPECT_TRUE(soon([&] { return withheld_seen.load(); }));
}

TEST(HapticLoop, IfAThreadCannotBeCreatedTheLoopDoesNotRun) {
  if (test::kSanitized) GTEST_SKIP() << "the sanitizer makes its own threads";
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, quietLoop());
  pthread_attr_t usual, huge;
  ASSERT_EQ(pthread_getattr_default_np(&usual), 0);
  ASSERT_EQ(pthread_attr_init(&huge), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&huge, std::size_t{1} << 47), 0);  // more than the address space
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  EXPECT_THROW(loop.start(), std::system_error);
  ASSERT_EQ(pthread_setattr_default_np(&usual), 0);
  EXPECT_FALSE(loop.running());
  EXPECT_EQ(device.exchanges, 0);
  loop.start();
  EXPECT_TRUE(soon([&] { return loop.ticks() > 10; }));
  loop.stop();
  pthread_attr_destroy(&usual);
  pthread_attr_destroy(&huge);
}

TEST(HapticLoop, RefusesTimesThatAreNegativeOrNotFinite) {
  NullDevice device;
  for (double HapticLoopOptions::*option : {&HapticLoopOptions::watchdog_s, &HapticLoopOptions::stall_s,
                                            &HapticLoopOptions::ramp_s, &HapticLoopOptions::fade_s}) {
    for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      HapticLoopOptions options;
      options.*option = bad;
      EXPECT_THROW(HapticLoop(
                       device, [](const DeviceState&, double) { return Wrench{}; }, options),
                   UsageError);
    }
  }
}

TEST(HapticLoop, RefusesARateThatIsNotPositiveAndFinite) {
  NullDevice device;
  for (const double rate_Hz :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    HapticLoopOptions options;
    options.rate_Hz = rate_Hz;
    EXPECT_THROW(HapticLoop(
                     device, [](const DeviceState&, double) { return Wrench{}; }, options),
                 UsageError);
  }
}

}  // namespace
}  // namespace filiform
