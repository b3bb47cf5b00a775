#include "device/bridge/bridge_device.h"
#include "tests/support/devices/bridge_process.h"
#include "tests/support/folders.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"
#include "tools/bridges/vendor_library.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <random>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

// The bridges to vendors' libraries, against mocks of these libraries (mock_dhd.c, mock_hd.c).
namespace filiform {
namespace {

using Eigen::Vector3d;

// The variable names the vendor's library; it is set for the process of the bridge.
void expectForceAndPositionInFrameD(const char* name, const char* variable, const char* mock, const Vector3d& rest_D,
                                    const Vector3d& v_D, std::uint32_t buttons) {
  const test::TempFolder folder;
  const test::Variable library(variable, test::inBuild("bridges/") + mock);
  test::BridgeProcess bridge(folder / "b", "", name);
  BridgeDevice device({.address = folder / "b", .silence_s = 60, .connect_s = 60});
  device.open();
  DeviceState state = device.exchange({});
  EXPECT_EQ(state.status, DeviceStatus::ready);
  EXPECT_NEAR((state.p_D - rest_D).norm(), 0, 1e-12) << state.p_D.transpose();
  EXPECT_NEAR((state.v_D - v_D).norm(), 0, 1e-12) << state.v_D.transpose();
  EXPECT_EQ(state.buttons, buttons);
  EXPECT_TRUE(device.capabilities().senses_orientation);
  EXPECT_LT((state.orientation_D.coeffs() - Eigen::Vector4d(0, 0.6, 0, 0.8)).norm(), 1e-12)
      << "both mocks turn upwards, about y: " << state.orientation_D.coeffs().transpose();
  Wrench wrench;
  wrench.force_N = {0.5, 1, -2};
  const Vector3d pushed_D = rest_D + 1e-3 * wrench.force_N;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while ((state.p_D - pushed_D).norm() > 1e-9 && std::chrono::steady_clock::now() < end) {
    state = device.exchange(wrench);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_NEAR((state.p_D - pushed_D).norm(), 0, 1e-9) << "force and position in the same frame";
  device.close();
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(), 0);
}

TEST(VendorBridges, ForceDimension) {
  expectForceAndPositionInFrameD("force_dimension", "FILIFORM_LIBDHD", "libmock_dhd.so", {0.02, 0.03, 0.01},
                                 {0.2, 0.3, 0.1}, 5);
}

TEST(VendorBridges, OpenHaptics) {
  expectForceAndPositionInFrameD("openhaptics", "FILIFORM_LIBHD", "libmock_hd.so", {0.01, 0.02, 0.03}, {0.1, 0.2, 0.3},
                                 2);
}

TEST(VendorBridges, EndWithoutTheVendorsLibrary) {
  const test::TempFolder folder;
  for (const char* const name : {"force_dimension", "openhaptics"}) {
    const test::Variable dhd("FILIFORM_LIBDHD", "/no/such/library.so"), hd("FILIFORM_LIBHD", "/no/such/library.so");
    EXPECT_THROW(test::BridgeProcess(folder / "b", "", name), std::runtime_error) << name;
  }
}

TEST(VendorBridges, TurnAnyMatrixIntoItsQuaternion) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> any;
  for (int i = 0; i < 10'000; ++i) {
    Eigen::Quaterniond q(any(random), any(random), any(random), any(random));
    if (i % 10 == 0) q.w() = 0;
    if (i % 30 == 0) q.x() = 0;
    q.normalize();
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> m = q.toRotationMatrix();
    double rows[3][3];
    std::copy_n(m.data(), 9, &rows[0][0]);
    const double(&matrix)[3][3] = rows;
    Eigen::Quaterniond out;
    to_quaternion(matrix, out.coeffs().data());
    ASSERT_LT((out.toRotationMatrix() - q.toRotationMatrix()).norm(), 1e-12) << i;
    ASSERT_NEAR(out.norm(), 1, 1e-12);
  }
}

}  // namespace
}  // namespace filiform
