// The driver and the simulated service by TCP, in real time.
#include "device/haply/haply_device.h"
#include "device/haply/simulated_haply.h"
#include "device/haply/simulated_haply_server.h"
#include "tests/support/no_alloc_guard.h"

#include <chrono>
#include <functional>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

Wrench rightwards(double force_N) {
  Wrench wrench;
  wrench.force_N.x() = force_N;
  return wrench;
}

struct SocketBench {
  explicit SocketBench(const SimulatedHaplyOptions& what = {}) : service(what), server(service) {
    options.port = server.port();
    options.timeout_s = 20;  // of a busy machine
  }
  // Exchanges until it holds; false after 20 s.
  bool await(HaplyDevice& haply, const Wrench& wrench, const std::function<bool(const DeviceState&)>& holds) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < until)
      if (holds(haply.exchange(wrench))) return true;
    return false;
  }
  SimulatedHaply service;
  SimulatedHaplyServer server;
  HaplyOptions options;
};

bool isReady(const DeviceState& state) { return state.status == DeviceStatus::ready; }
bool isLost(const DeviceState& state) { return state.status == DeviceStatus::fault; }

TEST(HaplySocket, RendersAForceByTcp) {
  SocketBench bench;
  HaplyDevice haply(bench.options);
  haply.open();
  ASSERT_TRUE(bench.await(haply, {}, isReady));
  EXPECT_TRUE(bench.await(haply, rightwards(1), [](const DeviceState& state) { return state.sent_N->x() > 0.5; }));
  EXPECT_TRUE(bench.await(haply, rightwards(1), [](const DeviceState& state) { return state.p_D.x() > 0.001; }));
  haply.close();
  EXPECT_GT(bench.service.strongest_N(), 0.5);
}

TEST(HaplySocket, ATickNeitherAllocatesNorLocks) {
  SocketBench bench;
  HaplyDevice haply(bench.options);
  haply.open();
  ASSERT_TRUE(bench.await(haply, {}, isReady));
  const std::uint64_t before = haply.counters().states;
  test::NoAllocGuard guard;
  for (int i = 0; i < 200; ++i) haply.exchange(rightwards(0.01 * i));
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.allocations, 0U) << calls.first;
  EXPECT_EQ(calls.locks, 0U) << calls.first;
  EXPECT_GT(haply.counters().states, before);
}

TEST(HaplySocket, ALostServiceIsAFaultThatIsExplained) {
  SocketBench bench;
  HaplyDevice haply(bench.options);
  haply.open();
  ASSERT_TRUE(bench.await(haply, {}, isReady));
  bench.service.faults().ends = true;
  EXPECT_TRUE(bench.await(haply, rightwards(1), isLost));
  EXPECT_NE(std::string(haply.advice()).find("ended the connection"), std::string::npos);
}

TEST(HaplySocket, AServiceThatIsSilentIsSentZero) {
  SocketBench bench;
  HaplyDevice haply(bench.options);
  haply.open();
  ASSERT_TRUE(bench.await(haply, {}, isReady));
  ASSERT_TRUE(bench.await(haply, rightwards(1), [](const DeviceState& state) { return state.sent_N->x() > 0.2; }));
  bench.service.faults().is_silent = true;
  EXPECT_TRUE(bench.await(haply, rightwards(1), [](const DeviceState& state) { return state.sent_N->isZero(); }));
  EXPECT_TRUE(bench.await(haply, rightwards(1), isLost));
  EXPECT_NE(std::string(haply.advice()).find("does not answer"), std::string::npos);
}

TEST(HaplySocket, SaysThatNoServiceRuns) {
  HaplyOptions options;
  {
    SimulatedHaply service;
    const SimulatedHaplyServer server(service);
    options.port = server.port();
  }
  HaplyDevice haply(options);
  try {
    haply.open();
    ADD_FAILURE() << "opened";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("does not run"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("systemctl start"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace filiform
