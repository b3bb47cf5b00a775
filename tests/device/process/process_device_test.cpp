#include "device/process/process_device.h"

#include "device/factory/device_factory.h"
#include "device/haply/simulated_haply_server.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/what_of.h"

#include <chrono>
#include <csignal>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// Waits up to 20 s for a condition that normally holds within milliseconds.
template <class Condition>
bool soon(Condition condition) {
  for (int i = 0; i < 20000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return condition();
}

TEST(ProcessDevice, SaysWhyTheDeviceCannotBeOpened) {
  const std::string why = test::whatOf<DeviceError>([] { makeDevice("haply:127.0.0.1:1"); });
  EXPECT_NE(why.find("the Haply Inverse Service does not run (127.0.0.1:1: "), std::string::npos) << why;
  EXPECT_EQ(why.find('\n'), std::string::npos) << why;
}

TEST(ProcessDevice, AMissingProgramIsNamedWithTheRemedy) {
  const std::string why =
      test::whatOf<DeviceError>([] { ProcessDevice({.device = "haply", .program = "/nowhere/filiform-device"}); });
  for (const char* text : {"filiform-device", "No such file", "--device haply,direct"})
    EXPECT_NE(why.find(text), std::string::npos) << why;
}

TEST(ProcessDevice, AProcessThatDiesOrHangsIsAnsweredWithZeroAndStartedAgain) {
  ProcessDevice device({.device = "null"});
  std::uint64_t deaths = 0;
  for (const int signal : {SIGKILL, SIGSEGV, SIGSTOP}) {
    device.open();
    ASSERT_TRUE(soon([&] { return device.exchange({}).status == DeviceStatus::ready; }));
    ASSERT_GT(device.processId(), 0);
    ::kill(device.processId(), signal);
    EXPECT_TRUE(soon([&] { return device.exchange({}).status == DeviceStatus::fault; })) << signal;
    ++deaths;
    EXPECT_TRUE(soon([&] { return device.rescues().zeroed == deaths; })) << signal;
    EXPECT_EQ(device.rescues().begun, deaths) << signal;
    EXPECT_STRNE(device.advice(), "");
  }
  device.open();
  EXPECT_TRUE(soon([&] { return device.exchange({}).status == DeviceStatus::ready; }));
  device.close();
  EXPECT_EQ(device.rescues().begun, deaths) << "an end that was asked for is no death";
  EXPECT_EQ(device.processId(), -1);
}

TEST(ProcessDevice, ExchangesWithoutAllocationOrLock) {
  ProcessDevice device({.device = "null"});
  device.open();
  device.exchange({});
  test::NoAllocGuard guard;
  for (int i = 0; i < 200; ++i) device.exchange({});
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.allocations + calls.locks, 0U) << calls.first;
}

TEST(ProcessDevice, IsTheDeviceThatTheProcessHolds) {
  SimulatedHaplyOptions options;
  options.is_led = true;
  options.clock = [begin = std::chrono::steady_clock::now()] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  SimulatedHaply service(options);
  const SimulatedHaplyServer server(service);
  service.faults().calibrated = false;
  const auto device = makeDevice("haply:127.0.0.1:" + std::to_string(server.port()));
  ASSERT_NE(dynamic_cast<ProcessDevice*>(device.get()), nullptr);
  device->open();
  const DeviceCapabilities& can = device->capabilities();
  EXPECT_EQ(can.name, "Haply Inverse3 049D");
  EXPECT_TRUE(can.paces_loop && can.needs_homing && can.is_led && can.senses_orientation && can.renders_model);
  EXPECT_GE(can.delay_samples, 1);
  EXPECT_GT(can.max_stiffness_N_m, 0);
  EXPECT_LT(can.max_stiffness_N_m, 500) << "the hop counts in the bound";
  // What the driver advises comes through; so does the force, once the device is ready.
  Wrench push;
  push.force_N = {0, 0, 1};
  EXPECT_TRUE(soon([&] {
    device->exchange(push);
    return std::string(device->advice()).find("calibrat") != std::string::npos;
  })) << device->advice();
  EXPECT_EQ(device->status(), DeviceStatus::homing);
  service.faults().calibrated = true;
  EXPECT_TRUE(soon([&] { return device->exchange(push).sent_N.value_or(Eigen::Vector3d::Zero()).z() > 0.9; }));
  EXPECT_STREQ(device->advice(), "");
  EXPECT_TRUE(soon([&] { return service.acting_N() > 0.9; }));
  device->close();
  EXPECT_TRUE(soon([&] { return service.acting_N() == 0; }));
}

}  // namespace
}  // namespace filiform
