// The program as a person with a Falcon and a SpaceMouse meets it.
#include "device/spacemouse/spacemouse.h"
#include "device/usb/usb_recording.h"
#include "tests/groups/umockdev/mock_usb.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <atomic>
#include <cstdlib>
#include <unistd.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::MockBytes;
using test::MockUsb;
using test::MockUsbDevice;
using test::Outcome;
using test::runFiliform;

UsbDeviceInfo falcon() {
  UsbDeviceInfo info;
  info.vendor = 0x0403;
  info.product = 0xcb48;
  info.bus_path = "1-1";
  info.product_name = "FALCON HAPTIC";
  info.interfaces = {{0, 0xff, 0xff, 0xff, {{0x81, UsbEndpointType::bulk, 64}, {0x02, UsbEndpointType::bulk, 64}}}};
  return info;
}

UsbDeviceInfo spaceMouse() {
  UsbDeviceInfo info;
  info.vendor = 0x046d;
  info.product = 0xc626;
  info.bus_path = "1-2";
  info.product_name = "SpaceNavigator";
  info.interfaces = {{0, 3, 0, 0, {{0x81, UsbEndpointType::interrupt, 8}}}};
  return info;
}

class DevicesUnderUmockdev : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = MockUsb::missing(); !why.empty()) GTEST_SKIP() << why;
    unsetenv("FILIFORM_FALCON_FIRMWARE");
    usb = std::make_unique<MockUsb>();
  }
  std::unique_ptr<MockUsb> usb;
};

TEST_F(DevicesUnderUmockdev, NothingPluggedInSaysWhatWouldBeRecognised) {
  const Outcome list = runFiliform({"devices"});
  EXPECT_EQ(list.exit_code, 0) << list.err;
  EXPECT_NE(list.out.find("no device that filiform can use is plugged in"), std::string::npos) << list.out;
  EXPECT_NE(list.out.find("Novint Falcon"), std::string::npos) << list.out;
  EXPECT_NE(list.out.find("3Dconnexion"), std::string::npos) << list.out;
  const Outcome test = runFiliform({"devices", "--test"});
  EXPECT_EQ(test.exit_code, 3);
  EXPECT_TRUE(test.oneLineOnStderr()) << test.err;
}

TEST_F(DevicesUnderUmockdev, ListsAFalconAndASpaceMouse) {
  usb->plug(falcon());
  MockUsbDevice& mouse = usb->plug(spaceMouse());
  const Outcome list = runFiliform({"devices"});
  EXPECT_EQ(list.exit_code, 0) << list.err;
  for (const char* text :
       {"1-1  0403:cb48  Novint Falcon (FALCON HAPTIC)", "--device falcon", "FILIFORM_FALCON_FIRMWARE",
        "1-2  046d:c626  3Dconnexion mouse (SpaceNavigator)", "--device spacemouse:1-2"})
    EXPECT_NE(list.out.find(text), std::string::npos) << text << "\n" << list.out;

  usb->forbid(mouse);
  if (geteuid() != 0) {  // root may open everything
    const auto json = nlohmann::json::parse(runFiliform({"devices", "--json"}).out);
    EXPECT_EQ(json.at("devices").at(1).at("state"), "no_permission");
  }
}

TEST_F(DevicesUnderUmockdev, TestsASpaceMouse) {
  MockUsbDevice& mouse = usb->plug(spaceMouse());
  const test::TempFolder folder;
  mouse.bind(0, "usbhid");
  std::atomic<bool> lit = false;
  mouse.onControl([&lit](const UsbSetup& setup, const MockBytes& data, MockUsbDevice& d) -> std::optional<MockBytes> {
    if (setup.request != 0x09 || data.size() != 2) return std::nullopt;
    if (data[1] == 1) {
      lit = true;
      for (int i = 0; i < 3; ++i) d.answer(0x81, {1, 0x5e, 1, 0, 0, 0, 0});
    }
    return MockBytes{};
  });
  const Outcome test = runFiliform({"devices", "--json", "--test", "spacemouse", "--record", folder.file("mouse.usb")});
  EXPECT_EQ(test.exit_code, 0) << test.err;
  const auto json = nlohmann::json::parse(test.out);
  EXPECT_EQ(json.at("test").at("reports"), 3);
  EXPECT_EQ(json.at("test").at("force_N"), 0);
  EXPECT_TRUE(lit);
  EXPECT_EQ(mouse.bound()[0], "usbhid") << "the kernel has it back";

  UsbReplay replay(folder.file("mouse.usb"));
  SpaceMouse again(replay);
  again.open();
  replay.pause(10);
  EXPECT_GT(again.exchange({}).v_D.x(), 0.09);
  EXPECT_EQ(again.reports(), 3U);
}

}  // namespace
}  // namespace filiform
