#include "device/simulated/scripted_path.h"

#include <limits>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

TEST(ScriptedPath, IsOnEachPointAtItsTime) {
  ScriptedPath device({{0.002, {0, 0, 0}, 0}, {0.004, {0.02, 0, 0}, 1}, {0.008, {0.02, 0.04, -0.04}, 0}});
  device.open();
  DeviceState state = device.exchange({});  // before the first point: at rest there
  EXPECT_EQ(state.p_D, Vector3d::Zero());
  EXPECT_EQ(state.v_D, Vector3d::Zero());
  device.exchange({});
  state = device.exchange({});  // half way to the second
  EXPECT_NEAR(state.p_D.x(), 0.01, 1e-15);
  EXPECT_NEAR(state.v_D.x(), 10, 1e-9);
  EXPECT_EQ(state.buttons, 0U);
  state = device.exchange({});
  EXPECT_EQ(state.p_D, Vector3d(0.02, 0, 0));
  EXPECT_EQ(state.buttons, 1U);
  for (int i = 0; i < 3; ++i) state = device.exchange({});
  EXPECT_FALSE(device.finished());
  state = device.exchange({});
  EXPECT_TRUE(device.finished());
  EXPECT_EQ(state.p_D, Vector3d(0.02, 0.04, -0.04));
  EXPECT_EQ(device.exchange({}).p_D, state.p_D) << "it rests there";
  EXPECT_EQ(device.exchange({}).v_D, Vector3d::Zero());
  device.open();
  EXPECT_FALSE(device.finished());
  EXPECT_EQ(device.exchange({}).time_s, 0.001);
}

TEST(ScriptedPath, PassesManyPointsInOnePeriod) {
  std::vector<ScriptedPoint> points;
  for (int i = 0; i < 1000; ++i) points.push_back({i * 1e-5, {i * 1e-6, 0, 0}, 0});
  ScriptedPath device(points);
  device.open();
  for (int i = 1; i <= 9; ++i) EXPECT_NEAR(device.exchange({}).p_D.x(), i * 1e-4, 1e-12);
}

TEST(ScriptedPath, MovesOnlyWhileReadyAndKeepsTheWrench) {
  ScriptedPath device({{0, {0, 0, 0}, 0}, {1, {1, 0, 0}, 0}});
  Wrench wrench;
  wrench.force_N = {0, 1, 0};
  EXPECT_EQ(device.exchange(wrench).status, DeviceStatus::closed);
  EXPECT_TRUE(device.lastWrench().force_N.isZero());
  device.open();
  device.exchange(wrench);
  EXPECT_EQ(device.lastWrench().force_N, wrench.force_N);
  wrench.force_N.x() = std::numeric_limits<double>::quiet_NaN();
  device.exchange(wrench);
  EXPECT_TRUE(device.lastWrench().force_N.isZero());
  const Vector3d there_D = device.exchange({}).p_D;
  device.close();
  EXPECT_EQ(device.exchange({}).p_D, there_D);
}

TEST(ScriptedPath, RefusesTimesThatDoNotRiseAndPointsThatAreNone) {
  EXPECT_THROW(ScriptedPath({}), DeviceError);
  EXPECT_THROW(ScriptedPath({{0, {0, 0, 0}, 0}, {0, {1, 0, 0}, 0}}), DeviceError);
  EXPECT_THROW(ScriptedPath({{-1, {0, 0, 0}, 0}}), DeviceError);
  EXPECT_THROW(ScriptedPath({{0, {0, std::numeric_limits<double>::infinity(), 0}, 0}}), DeviceError);
  EXPECT_THROW(ScriptedPath({{0, {0, 0, 0}, 0}}, 0), DeviceError);
}

}  // namespace
}  // namespace filiform
