#include "device/bridge/bridge_device.h"
#include "device/bridge/bridge_folder.h"
#include "tests/support/devices/bridge_process.h"
#include "tests/support/folders.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"
#include "tools/bridges/vendor_library.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
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
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  DeviceState state;
  do {
    state = device.exchange({});
  } while (state.status != DeviceStatus::ready && std::chrono::steady_clock::now() < end);
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
                                 {0.2, 0.3, 0.1}, 1);
}

TEST(VendorBridges, OpenHaptics) {
  expectForceAndPositionInFrameD("openhaptics", "FILIFORM_LIBHD", "libmock_hd.so", {0.01, 0.02, 0.03}, {0.1, 0.2, 0.3},
                                 2);
}

struct VendorRow {  // of the bridge's log
  std::int64_t time_ns = 0, command_ns = 0;
  int mode = 0;
  double force_N = 0, p_m[3] = {};
};

std::vector<VendorRow> vendorRows(const std::string& log) {
  std::vector<VendorRow> rows;
  std::ifstream in(log);
  for (VendorRow r; in >> r.time_ns >> r.command_ns >> r.mode >> r.force_N >> r.p_m[0] >> r.p_m[1] >> r.p_m[2];)
    rows.push_back(r);
  return rows;
}

std::string vendorText(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

int timesInText(const std::string& text, const std::string& part) {
  int times = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++times;
  return times;
}

TEST(VendorBridges, Chai3d) {
  expectForceAndPositionInFrameD("mock_chai3d", "FILIFORM_MOCK", "one", {0.02, 0.03, 0.01}, {0.2, 0.3, 0.1}, 1);
}

TEST(VendorBridges, Chai3dTellsItsDevicesApartByNumber) {
  const test::TempFolder folder;
  const test::Variable runtime("XDG_RUNTIME_DIR", folder.path());
  const std::string program = test::bridgeProgram("mock_chai3d");
  for (const char* const wanted : {"", "Falcon", "1x", "2"}) {
    std::vector<std::string> words{program};
    if (*wanted != 0) words.insert(words.end(), {"--device", wanted});
    EXPECT_THROW(test::StartedProcess(words, folder / "err"), std::runtime_error) << wanted;
    EXPECT_EQ(vendorText(folder / "err"),
              "bridge: name one of the devices by its number, as in --device 1: 0 omega.6, 1 Falcon\n");
  }
  const test::StartedProcess falcon({program, "--device", "1"}, folder / "err");
  const BridgeDevice device({.address = folder / "filiform/chai3d-1.bridge"});
  EXPECT_EQ(device.capabilities().buttons, 4);
  EXPECT_EQ(device.capabilities().peak_force_N, 8);
  EXPECT_FALSE(device.capabilities().senses_orientation);
}

// A bridge to a mock of a vendor's library in a folder of its own.
struct MockedBridge {
  MockedBridge(const std::string& name, const std::string& library, const std::string& mock,
               const std::string& variable = "FILIFORM_MOCK", const std::string& faults = "")
      : process({test::bridgeProgram(name), folder / "b"}, folder / "err",
                {"FILIFORM_BRIDGE_LOG=" + (folder / "log"), library + "=" + test::inBuild("bridges/") + mock,
                 variable + "=" + faults, "FILIFORM_MOCK_HD_FRAMES=" + (folder / "frames")}),
        device({.address = folder / "b", .silence_s = 60, .connect_s = 60}) {
    device.open();
  }
  // Commands 1 N to the right once a millisecond, until `done`, for at most 60 s.
  void pushUntil(const std::function<bool(const DeviceState&)>& done) {
    Wrench wrench;
    wrench.force_N.x() = 1;
    auto due = std::chrono::steady_clock::now();
    const auto end = due + std::chrono::seconds(60);
    while (!done(device.exchange(wrench)) && due < end)
      std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    EXPECT_LT(due, end) << vendorText(folder / "err");
  }
  void pushUntilReady(bool ready) {
    pushUntil([ready](const DeviceState& s) { return (s.status == DeviceStatus::ready) == ready; });
  }
  void pushUntilFull() {
    pushUntil([](const DeviceState& s) { return s.sent_N && s.sent_N->x() > 1 - 1e-9; });
  }
  test::TempFolder folder;
  test::StartedProcess process;
  BridgeDevice device;
};

// The full force, 1 N, in 50 ms: a loop that another job holds up fades, and grows so fast again.
constexpr double kGrow_N_ns = 20.2e-9;

// Times are printed, not asserted: the machine is shared.
TEST(VendorBridges, OpenHapticsRendersInEachFrameOfTheServo) {
  MockedBridge touch("openhaptics", "FILIFORM_LIBHD", "libmock_hd.so");
  EXPECT_EQ(touch.device.capabilities().peak_force_N, 3.4) << "the device's own";
  EXPECT_NEAR(touch.device.capabilities().workspace_hi_D.x(), 0.19, 1e-12);
  EXPECT_GE(touch.device.capabilities().delay_samples, 2) << "a command acts in the next frame";
  touch.pushUntilFull();
  int ticks = 0;
  const auto before = touch.device.counters();
  touch.pushUntil([&](const DeviceState&) { return ++ticks == 2000; });
  const auto after = touch.device.counters();
  touch.process.signal(SIGTERM);
  EXPECT_EQ(touch.process.wait(), 0);
  const std::vector<VendorRow> rows = vendorRows(touch.folder / "log");
  std::istringstream frames(vendorText(touch.folder / "frames"));
  std::size_t rendered = 0;
  double left_N = 1;
  frames >> rendered >> left_N;
  EXPECT_EQ(rows.size(), rendered);
  EXPECT_EQ(left_N, 0) << "the last force";
  const double seconds = 1e-9 * static_cast<double>(rows.back().time_ns - rows.front().time_ns);
  std::printf("servo %.0f Hz; %llu of %llu exchanges without a STATE within 2 ms\n",
              static_cast<double>(rows.size() - 1) / seconds,
              static_cast<unsigned long long>(after.unanswered - before.unanswered),
              static_cast<unsigned long long>(after.commands - before.commands));
}

TEST(VendorBridges, OpenHapticsRecoversFromForceErrorsAndAsksForTheInkwell) {
  MockedBridge touch("openhaptics", "FILIFORM_LIBHD", "libmock_hd.so", "FILIFORM_MOCK_HD",
                     "warm:2500 velocity:8000 inkwell:12000 unplug:16500");
  touch.pushUntilFull();
  for (int fault = 0; fault < 3; ++fault) {
    touch.pushUntilReady(false);
    touch.pushUntilReady(true);
    touch.pushUntilFull();
  }
  touch.pushUntil([](const DeviceState& s) { return s.status == DeviceStatus::fault; });
  EXPECT_EQ(touch.process.wait(), 3);
  const std::string said = vendorText(touch.folder / "err");
  for (const char* const line :
       {"the motors are warm: no force for 2 s\n", "the hand was too fast: no force for 0.5 s\n",
        "not calibrated: put the stylus into its inkwell, then take it out\n", "openhaptics: calibrated\n",
        "the device was lost, or the scheduler failed: connect it and start again\n"})
    EXPECT_EQ(timesInText(said, line), 1) << line << said;
  EXPECT_EQ(timesInText(said, "\n"), 5) << said;
  // A row is a frame: the force is off from the frame after the error on, and comes back by a ramp.
  const std::vector<VendorRow> rows = vendorRows(touch.folder / "log");
  ASSERT_GT(rows.size(), 16500U);
  EXPECT_GT(rows[2499].force_N, 0.5);
  EXPECT_GT(rows[7999].force_N, 0.5);
  for (const std::size_t from : {2500, 8000})
    for (std::size_t i = from; i < from + 100; ++i) ASSERT_EQ(rows[i].force_N, 0) << i;
  for (std::size_t i = 1; i < rows.size(); ++i)
    ASSERT_LE(rows[i].force_N - rows[i - 1].force_N,
              0.02 + kGrow_N_ns * static_cast<double>(rows[i].time_ns - rows[i - 1].time_ns))
        << i;
}

TEST(VendorBridges, TellsOfALossBetweenTwoCommands) {
  MockedBridge touch("openhaptics", "FILIFORM_LIBHD", "libmock_hd.so", "FILIFORM_MOCK_HD", "unplug:2000");
  touch.pushUntilReady(true);
  EXPECT_EQ(touch.process.wait(), 3);
  EXPECT_EQ(touch.device.exchange({}).status, DeviceStatus::fault);
  EXPECT_STREQ(touch.device.advice(), "the device was lost, or the scheduler failed: connect it and start again");
}

TEST(VendorBridges, OpenHapticsEndsIfTheSchedulerRefuses) {
  const test::TempFolder folder;
  const test::Variable library("FILIFORM_LIBHD", test::inBuild("bridges/") + "libmock_hd.so"),
      faults("FILIFORM_MOCK_HD", "licence:1");
  EXPECT_THROW(test::StartedProcess({test::bridgeProgram("openhaptics"), folder / "b"}, folder / "err"),
               std::runtime_error);
  EXPECT_EQ(vendorText(folder / "err"),
            "bridge: openhaptics: the scheduler cannot start: see whether the library's licence is valid\n");
}

TEST(VendorBridges, TwoTouchesAreToldApartByName) {
  const test::TempFolder folder;
  const test::Variable library("FILIFORM_LIBHD", test::inBuild("bridges/") + "libmock_hd.so"),
      runtime("XDG_RUNTIME_DIR", folder.path());
  const std::string program = test::bridgeProgram("openhaptics");
  const test::StartedProcess first({program}), second({program, "--device", "Left"});
  const std::vector<FoundBridge> found = findBridges();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].path, folder / "filiform/openhaptics-Left.bridge");
  EXPECT_EQ(found[1].path, folder / "filiform/openhaptics.bridge");
  EXPECT_EQ(BridgeDevice({.address = found[0].path}).capabilities().name, "openhaptics-Left (bridge)");
  EXPECT_THROW(test::StartedProcess({program, "--device", "Right"}, folder / "err"), std::runtime_error);
  EXPECT_EQ(vendorText(folder / "err"),
            "bridge: Right cannot be opened: see whether the vendor's diagnostic finds it, and under which name\n");
}

TEST(VendorBridges, ForceDimensionWaitsWhileTheControllerHasNoForce) {
  MockedBridge omega("force_dimension", "FILIFORM_LIBDHD", "libmock_dhd.so", "FILIFORM_MOCK",
                     "off:4000 fast:7000 reset:10000");
  omega.pushUntilFull();
  for (int fault = 0; fault < 3; ++fault) {
    omega.pushUntilReady(false);
    omega.pushUntilReady(true);
    omega.pushUntilFull();
  }
  omega.process.signal(SIGTERM);
  EXPECT_EQ(omega.process.wait(), 0);
  const std::string said = vendorText(omega.folder / "err");
  for (const char* const line :
       {"the force was switched off: press the controller's force button\n",
        "the device was too fast, so the controller has switched the force off: press the controller's force button\n",
        "the device is not calibrated: put it into its rest, and press the controller's reset button\n"})
    EXPECT_EQ(timesInText(said, line), 1) << line << said;
  EXPECT_EQ(timesInText(said, "the force is on\n"), 3) << said;
  const std::vector<VendorRow> rows = vendorRows(omega.folder / "log");
  for (std::size_t i = 1; i < rows.size(); ++i)
    ASSERT_LE(rows[i].force_N - rows[i - 1].force_N,
              0.02 + kGrow_N_ns * static_cast<double>(rows[i].time_ns - rows[i - 1].time_ns))
        << i;
}

TEST(VendorBridges, TwoOmegasAreToldApartBySerialNumber) {
  const test::TempFolder folder;
  const test::Variable library("FILIFORM_LIBDHD", test::inBuild("bridges/") + "libmock_dhd.so"),
      two("FILIFORM_MOCK", "two:1"), runtime("XDG_RUNTIME_DIR", folder.path());
  const std::string program = test::bridgeProgram("force_dimension");
  for (const char* const wanted : {"", "1205"}) {
    std::vector<std::string> words{program};
    if (*wanted != 0) words.insert(words.end(), {"--device", wanted});
    EXPECT_THROW(test::StartedProcess(words, folder / "err"), std::runtime_error);
    EXPECT_EQ(
        vendorText(folder / "err"),
        "bridge: name one of the devices by its serial number, as in --device 1234: mock serial 1203, mock serial "
        "1204\n");
  }
  const test::StartedProcess second({program, "--device", "1204"}, folder / "err");
  ASSERT_EQ(findBridges().size(), 1U);
  EXPECT_EQ(findBridges()[0].path, folder / "filiform/force-dimension-1204.bridge");
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
