#include "solver/haptic_loop.h"

#include "device/null_device.h"
#include "device/simulated_hand.h"
#include "index/errors.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;

// A device that a test may watch and change while the loop runs.
class WatchedDevice : public HapticDevice {
 public:
  explicit WatchedDevice(bool paces = false) { capabilities_.paces_loop = paces; }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return status_; }
  void open() override {}
  void close() noexcept override {}
  DeviceState exchange(const Wrench& wrench) noexcept override {
    if (capabilities_.paces_loop) std::this_thread::sleep_for(1ms);
    last_force_N = wrench.force_N.x();
    ++exchanges;
    DeviceState state;
    if (!frozen) ++periods_;
    state.time_s = 0.001 * periods_;
    state.status = status_;
    return state;
  }
  void setStatus(DeviceStatus status) { status_ = status; }

  std::atomic<double> last_force_N{0};
  std::atomic<int> exchanges{0};
  std::atomic<bool> frozen{false};

 private:
  DeviceCapabilities capabilities_;
  std::atomic<DeviceStatus> status_{DeviceStatus::ready};
  int periods_ = 0;
};

HapticLoopOptions quiet() {
  HapticLoopOptions options;
  options.realtime_priority = options.lock_memory = false;
  return options;
}

template <class Condition>
bool soon(Condition condition) {  // generous: what is waited for happens within milliseconds
  for (int i = 0; i < 20000 && !condition(); ++i) std::this_thread::sleep_for(1ms);
  return condition();
}

Wrench push(double force_N) {
  Wrench wrench;
  wrench.force_N.x() = force_N;
  return wrench;
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
  EXPECT_EQ(device.exchanges, ticks + 1);
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
        quiet());
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
      device, [](const DeviceState&, double) { return push(1); }, quiet());
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
      quiet());
  loop.start();
  ASSERT_TRUE(soon([&] { return !loop.running(); }));
  EXPECT_EQ(device.last_force_N, 0);
  EXPECT_NE(loop.fault(), "");
  loop.stop();
}

TEST(HapticLoop, FaultOfTheDeviceEndsItWithZeroForceAndItCanStartAgain) {
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, quiet());
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
      quiet());
  loop.start();
  ASSERT_TRUE(soon([&] { return ticks > 20; }));
  EXPECT_EQ(device.last_force_N, 0);
  device.setStatus(DeviceStatus::ready);
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}

TEST(HapticLoop, WatchdogTakesTheForceFromADeviceThatStandsStill) {
  WatchedDevice device;
  HapticLoopOptions options = quiet();
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

TEST(HapticLoop, SendsZeroForAForceThatIsNotFinite) {
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(std::numeric_limits<double>::quiet_NaN()); }, quiet());
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
      quiet());
  loop.start();
  ASSERT_TRUE(soon([&] { return loop.ticks() >= 5; }));
  loop.stop();
  EXPECT_EQ(loop.metrics().missed_deadlines(), loop.metrics().ticks());
}

TEST(HapticLoop, RefusesARateThatIsNone) {
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
