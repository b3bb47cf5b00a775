// A Falcon driver on a simulated device, as the tests of the driver use it.
#pragma once

#include "device/falcon/falcon.h"
#include "tests/support/devices/fake_falcon.h"

#include <fstream>
#include <functional>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace filiform::test {

// Writes a firmware image of `bytes` bytes. Returns its path.
inline std::string writeImage(const std::string& path, std::size_t bytes = 7914) {
  std::ofstream file(path, std::ios::binary);
  for (std::size_t i = 0; i < bytes; ++i) file.put(static_cast<char>(i * i % 251));
  return path;
}

inline Wrench push(const Eigen::Vector3d& force_N) {
  Wrench wrench;
  wrench.force_N = force_N;
  return wrench;
}

// A device with firmware, and a driver that has opened it.
struct FalconBench {
  explicit FalconBench(bool homed = true, FalconOptions options = {}) : falcon(usb, std::move(options)) {
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

}  // namespace filiform::test
