#include "device/check/found_devices.h"
#include "device/factory/device_factory.h"
#include "device/simulated/null_device.h"
#include "device/simulated/simulated_hand.h"
#include "solver/loop/device_test.h"
#include "tests/support/devices/fake_usb.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tests/support/what_of.h"

#include <cstdlib>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using test::FakeUsb;
using test::Outcome;
using test::runFiliform;

TEST(Devices, FindsWhatThisBuildHasADriverFor) {
  FakeUsb usb;
  EXPECT_TRUE(findDevices(usb).empty());
  usb.plug(test::fakeBulkDevice(0x0403, 0xcb48, "1-2", "FALCON HAPTIC"));
  usb.plug(test::fakeBulkDevice(0x0403, 0x6001, "1-3", "a serial cable"));
  usb.plug(test::fakeBulkDevice(0x256f, 0xc635, "1-4", "SpaceMouse Compact")).permitted = false;
  const test::TempFolder folder;
  test::writeBytes(folder.file("firmware.bin"), "x");

  unsetenv("FILIFORM_FALCON_FIRMWARE");
  std::vector<FoundDevice> found = findDevices(usb);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].device, "falcon");
  EXPECT_EQ(found[0].state, "no_firmware");
  EXPECT_NE(found[0].remedy.find("FILIFORM_FALCON_FIRMWARE"), std::string::npos) << found[0].remedy;
  EXPECT_EQ(found[1].device, "spacemouse:1-4");
  EXPECT_EQ(found[1].state, "no_permission");
  EXPECT_NE(found[1].remedy.find("70-filiform.rules"), std::string::npos) << found[1].remedy;

  setenv("FILIFORM_FALCON_FIRMWARE", folder.file("firmware.bin").c_str(), 1);
  found = findDevices(usb);
  EXPECT_EQ(found[0].state, "ready");
  EXPECT_EQ(found[0].remedy, "");
  setenv("FILIFORM_FALCON_FIRMWARE", folder.file("none").c_str(), 1);
  EXPECT_EQ(findDevices(usb)[0].state, "no_firmware");
  unsetenv("FILIFORM_FALCON_FIRMWARE");
}

TEST(Devices, TwoFalconsAreToldApartBySocketOrSerialNumber) {
  FakeUsb usb;
  usb.plug(test::fakeBulkDevice(0x0403, 0xcb48, "1-2", "FALCON HAPTIC"));
  UsbDeviceInfo second = test::fakeBulkDevice(0x0403, 0xcb48, "1-4.1", "FALCON HAPTIC");
  second.serial = "FL77";
  usb.plug(second);
  const std::vector<FoundDevice> found = findDevices(usb);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].device, "falcon,1-2");
  EXPECT_EQ(found[1].device, "falcon,1-4.1");
  for (const char* device : {"falcon", "falcon,1-4.1", "falcon,FL77", "falcon:firmware.bin,FL77"})
    EXPECT_TRUE(isPluggedIn(usb, device)) << device;
  EXPECT_FALSE(isPluggedIn(usb, "falcon,1-3"));
  const auto refusal = [&usb](const char* device) {
    return test::whatOf<DeviceError>([&] { makeDevice(device, {.usb = &usb})->open(); });
  };
  EXPECT_EQ(refusal("falcon"),
            "several Falcons are plugged in: name one by its USB socket, as in falcon,1-2 or falcon,1-4.1");
  EXPECT_NE(refusal("falcon,1-3").find("no Novint Falcon (USB 0403:cb48) is plugged in at 1-3"), std::string::npos);
  EXPECT_EQ(refusal("falcon,FL77").find("several"), std::string::npos);
}

TEST(Devices, SaysWhetherWhatWasAskedForIsPluggedIn) {
  FakeUsb usb;
  for (const char* device : {"falcon", "spacemouse", "mouse"}) EXPECT_FALSE(isPluggedIn(usb, device)) << device;
  usb.plug(test::fakeBulkDevice(0x0403, 0xcb48, "1-2", "FALCON HAPTIC"));
  test::FakeUsbDevice& mouse = usb.plug(test::fakeBulkDevice(0x256f, 0xc635, "1-4", "SpaceMouse Compact"));
  for (const char* device : {"falcon", "falcon:firmware.bin", "spacemouse", "spacemouse:1-4"})
    EXPECT_TRUE(isPluggedIn(usb, device)) << device;
  for (const char* device : {"spacemouse:1-5", "mouse", "sim:firm", ""})
    EXPECT_FALSE(isPluggedIn(usb, device)) << device;
  mouse.permitted = false;
  EXPECT_FALSE(isPluggedIn(usb, "spacemouse"));
  usb.unplug(mouse);
  EXPECT_FALSE(isPluggedIn(usb, "spacemouse:1-4"));
}

// device_checker_test.cpp tests the results in the hand's virtual time.
TEST(Devices, CheckReadsAndPushesAHandAndClosesIt) {
  SimulatedHandOptions options;
  options.hand = handParameters("medium");
  SimulatedHand hand(options);
  const DeviceCheck check = checkDevice(hand, {.read_s = 0.05, .ramp_s = 0.1});
  EXPECT_EQ(hand.status(), DeviceStatus::closed);
  EXPECT_GT(check.exchanges, 0U);
  EXPECT_GE(check.seconds, 0.05);
  EXPECT_FALSE(check.stopped);
  EXPECT_LE(check.force_N, 0.5);
}

TEST(Devices, CheckOfADeviceWithoutForceOnlyReads) {
  NullDevice device;
  device.setButtons(5);
  const DeviceCheck check = checkDevice(device, {.read_s = 0.05});
  EXPECT_EQ(check.force_N, 0);
  EXPECT_EQ(check.buttons, 5U);
  EXPECT_EQ(device.lastWrench().force_N, Eigen::Vector3d::Zero());
}

TEST(Devices, CheckGivesUpOnADeviceThatIsNeverHomed) {
  class Homing : public NullDevice {
    void open() override {
      NullDevice::open();
      setStatus(DeviceStatus::homing);
    }
  } device;
  std::string told;
  EXPECT_THROW(checkDevice(device, {.homing_s = 0.2, .tell = [&told](const std::string& text) { told += text; }}),
               DeviceError);
  EXPECT_NE(told.find("pull the grip"), std::string::npos) << told;
  EXPECT_EQ(device.status(), DeviceStatus::closed);
}

TEST(Devices, ProgramListsAndTests) {
  const Outcome list = runFiliform({"devices"});
  EXPECT_EQ(list.exit_code, 0) << list.err;
  EXPECT_NE(list.out.find("sim:medium"), std::string::npos) << list.out;
  EXPECT_EQ(list.err, "");

  const Outcome json = runFiliform({"devices", "--json"});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  const nlohmann::json parsed = nlohmann::json::parse(json.out);
  EXPECT_TRUE(parsed.at("devices").is_array());
  EXPECT_EQ(parsed.at("recognised").at(0).at("ids"), "0403:cb48");

  const Outcome test = runFiliform({"devices", "--json", "--test", "sim:medium"});
  EXPECT_EQ(test.exit_code, 0) << test.err;
  const nlohmann::json tested = nlohmann::json::parse(test.out).at("test");
  EXPECT_EQ(tested.at("device"), "sim:medium");
  EXPECT_GT(tested.at("rate_Hz"), 0);
  EXPECT_EQ(tested.at("moved_m").size(), 3U);

  const Outcome people = runFiliform({"devices", "--test", "sim:medium"});
  EXPECT_NE(people.out.find("the hand gave way by"), std::string::npos) << people.out;
  EXPECT_EQ(runFiliform({"devices", "--test", "sim:iron"}).exit_code, 2);
  EXPECT_EQ(runFiliform({"devices", "--record", "x.usb"}).exit_code, 2);
}

}  // namespace
}  // namespace filiform::tools
