#include "device/simulated/null_device.h"

#include <limits>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

TEST(NullDevice, ReadsTheCentreUntilItIsPutElsewhere) {
  NullDevice device;
  device.open();
  EXPECT_EQ(device.exchange({}).p_D, Vector3d::Zero());
  device.setPosition({0.01, 0.02, 0.03});
  device.setPosition({0, std::numeric_limits<double>::quiet_NaN(), 0});
  device.setButtons(5);
  const DeviceState state = device.exchange({});
  EXPECT_EQ(state.p_D, Vector3d(0.01, 0.02, 0.03));
  EXPECT_EQ(state.v_D, Vector3d::Zero());
  EXPECT_EQ(state.buttons, 5U);
  EXPECT_DOUBLE_EQ(state.time_s, 0.002);
}

TEST(NullDevice, RendersNothingUnlessReady) {
  NullDevice device;
  EXPECT_EQ(device.capabilities().peak_force_N, 0);
  Wrench wrench;
  wrench.force_N = {1, 2, 3};
  for (const auto status :
       {DeviceStatus::closed, DeviceStatus::booting, DeviceStatus::homing, DeviceStatus::ready, DeviceStatus::fault}) {
    device.setStatus(status);
    EXPECT_EQ(device.exchange(wrench).status, status);
    EXPECT_EQ(device.lastWrench().force_N.isZero(), status != DeviceStatus::ready) << toString(status);
  }
  device.open();
  wrench.torque_Nm.x() = std::numeric_limits<double>::infinity();
  device.exchange(wrench);
  EXPECT_TRUE(device.lastWrench().force_N.isZero()) << "a wrench that is not finite";
  device.close();
  EXPECT_EQ(device.status(), DeviceStatus::closed);
}

TEST(NullDevice, RefusesAPeriodThatIsNone) { EXPECT_THROW(NullDevice(0), DeviceError); }

TEST(DeviceStatus, HasAName) {
  EXPECT_STREQ(toString(DeviceStatus::closed), "closed");
  EXPECT_STREQ(toString(DeviceStatus::booting), "booting");
  EXPECT_STREQ(toString(DeviceStatus::homing), "homing");
  EXPECT_STREQ(toString(DeviceStatus::ready), "ready");
  EXPECT_STREQ(toString(DeviceStatus::fault), "fault");
}

}  // namespace
}  // namespace filiform
