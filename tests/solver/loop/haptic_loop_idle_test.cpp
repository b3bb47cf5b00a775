#include "device/simulated/null_device.h"
#include "solver/loop/haptic_loop.h"
#include "tests/support/devices/haptic_loops.h"
#include "tests/support/devices/paced_device.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// 't': a tick, 'i': idle work.
std::vector<char> callsOf(HapticDevice& device, std::vector<double>& free_s) {
  std::vector<char> calls;
  calls.reserve(1 << 16);
  free_s.reserve(1 << 16);
  std::atomic<int> ticks{0};
  HapticLoopOptions options = test::quietLoop();
  options.idle = [&](double s) {
    calls.push_back('i');
    free_s.push_back(s);
  };
  device.open();
  HapticLoop loop(
      device,
      [&](const DeviceState&, double) {
        calls.push_back('t');
        ++ticks;
        return Wrench{};
      },
      options);
  loop.start();
  while (ticks < 20) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  loop.stop();
  return calls;
}

TEST(HapticLoopIdle, FollowsEachTickWithTheTimeThatIsLeft) {
  NullDevice device;
  std::vector<double> free_s;
  const std::vector<char> calls = callsOf(device, free_s);
  ASSERT_GE(calls.size(), 40u);
  for (std::size_t i = 0; i < calls.size(); ++i) EXPECT_EQ(calls[i], i % 2 == 0 ? 't' : 'i') << i;
  for (const double s : free_s) {
    EXPECT_GE(s, 0);
    EXPECT_LE(s, 0.001);
  }
  EXPECT_GT(*std::max_element(free_s.begin(), free_s.end()), 0);
}

TEST(HapticLoopIdle, HasNoTimeWhereTheDevicePacesTheLoop) {
  test::PacedDevice device(0.001, Eigen::Vector3d::Zero());
  std::vector<double> free_s;
  callsOf(device, free_s);
  ASSERT_FALSE(free_s.empty());
  EXPECT_EQ(std::count(free_s.begin(), free_s.end(), 0.0), static_cast<std::ptrdiff_t>(free_s.size()));
}

TEST(HapticLoopIdle, AnExceptionEndsTheLoopWithAFault) {
  NullDevice device;
  device.open();
  HapticLoopOptions options = test::quietLoop();
  options.idle = [](double) { throw std::runtime_error("enough"); };
  HapticLoop loop(
      device, [](const DeviceState&, double) { return Wrench{}; }, options);
  loop.start();
  for (int i = 0; i < 20000 && loop.running(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_FALSE(loop.running());
  EXPECT_FALSE(loop.fault().empty());
}

}  // namespace
}  // namespace filiform
