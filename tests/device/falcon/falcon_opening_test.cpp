// Finding and opening a Falcon: permissions, firmware, several devices.
#include "device/falcon/falcon.h"
#include "tests/support/devices/falcon_bench.h"
#include "tests/support/temp_folder.h"
#include "tests/support/what_of.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::FakeFalcon;
using test::FakeUsb;
using test::writeImage;

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Falcon, SaysWhatIsMissing) {
  const test::TempFolder folder;
  FakeUsb usb;
  Falcon falcon(usb);
  const auto open = [&] { falcon.open(); };
  EXPECT_TRUE(holds(test::whatOf<DeviceError>(open), "no Novint Falcon"));
  EXPECT_EQ(falcon.status(), DeviceStatus::closed);
  FakeFalcon fake(usb);
  fake.usb_device().permitted = false;
  EXPECT_TRUE(holds(test::whatOf<DeviceError>(open), kUdevRule));
  fake.usb_device().permitted = true;
  const std::string no_firmware = test::whatOf<DeviceError>(open);
  EXPECT_TRUE(holds(no_firmware, kFalconFirmwareVariable)) << no_firmware;
  EXPECT_TRUE(holds(no_firmware, "--device falcon:FILE")) << no_firmware;
  EXPECT_EQ(falcon.status(), DeviceStatus::closed);

  const std::string nowhere = folder.file("none.bin");
  EXPECT_TRUE(holds(test::whatOf<DeviceError>([&] { Falcon(usb, {.firmware = nowhere}).open(); }), nowhere));
  for (const std::size_t bytes : {std::size_t{0}, kFalconFirmwareLeast - 1, kFalconFirmwareMost + 1}) {
    const std::string path = writeImage(folder.file("image.bin"), bytes);
    EXPECT_TRUE(
        holds(test::whatOf<DeviceError>([&] { Falcon(usb, {.firmware = path}).open(); }), "not Falcon firmware"))
        << bytes;
  }
  EXPECT_TRUE(fake.image.empty());
  EXPECT_TRUE(usb.violations().empty()) << usb.violations().front();
}

TEST(Falcon, LoadsTheFirmwareThatItIsGiven) {
  const test::TempFolder folder;
  for (const bool by_environment : {false, true}) {
    FakeUsb usb;
    FakeFalcon fake(usb);
    const std::string path = writeImage(folder.file("image.bin"));
    if (by_environment) setenv(kFalconFirmwareVariable, path.c_str(), 1);
    Falcon falcon(usb, {.firmware = by_environment ? "" : path});
    unsetenv(kFalconFirmwareVariable);
    falcon.open();
    EXPECT_EQ(falcon.status(), DeviceStatus::homing);
    EXPECT_TRUE(fake.running);
    std::ifstream file(path, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    EXPECT_EQ(fake.image, bytes);
    EXPECT_LT(usb.time_s(), 3);
    // The second time the firmware runs already and is not loaded.
    falcon.close();
    const double closed_s = usb.time_s();
    Falcon again(usb);
    again.open();
    EXPECT_LT(usb.time_s() - closed_s, 0.1);
    EXPECT_TRUE(usb.violations().empty()) << usb.violations().front();
  }
}

TEST(Falcon, AWrongEchoIsTriedAgainAndGivenUpInTheEnd) {
  const test::TempFolder folder;
  const std::string path = writeImage(folder.file("image.bin"));
  for (const std::size_t at : {std::size_t{0}, std::size_t{61}, std::size_t{62}, std::size_t{7913}}) {
    FakeUsb usb;
    FakeFalcon fake(usb);
    fake.wrong_echo = at;
    Falcon falcon(usb, {.firmware = path});
    falcon.open();
    EXPECT_EQ(falcon.status(), DeviceStatus::homing) << at;
    EXPECT_EQ(fake.image.size(), 7914u);
    EXPECT_TRUE(usb.violations().empty()) << usb.violations().front();
  }
  FakeUsb usb;
  FakeFalcon fake(usb);
  fake.wrong_echo = 100;
  fake.bad_attempts = 1000;
  Falcon falcon(usb, {.firmware = path});
  const std::string why = test::whatOf<DeviceError>([&] { falcon.open(); });
  EXPECT_TRUE(holds(why, "5 attempts")) << why;
  EXPECT_TRUE(holds(why, "byte 100")) << why;
  EXPECT_EQ(falcon.status(), DeviceStatus::closed);
}

TEST(Falcon, FirmwareThatDoesNotAnswerIsNamed) {
  const test::TempFolder folder;
  FakeUsb usb;
  FakeFalcon fake(usb);
  fake.mute = true;
  const std::string path = writeImage(folder.file("image.bin"));
  Falcon falcon(usb, {.firmware = path});
  const std::string why = test::whatOf<DeviceError>([&] { falcon.open(); });
  EXPECT_TRUE(holds(why, path)) << why;
  EXPECT_TRUE(holds(why, "does not answer")) << why;
}

TEST(Falcon, TwoDevicesAreToldApartByTheirSockets) {
  FakeUsb usb;
  FakeFalcon left(usb, "1-1"), right(usb, "1-2");
  left.powerUp(true);
  right.powerUp(true);
  Falcon falcon(usb, {.bus_path = "1-2"});
  falcon.open();
  falcon.exchange({});
  EXPECT_TRUE(left.received().empty());
  EXPECT_FALSE(right.received().empty());
  EXPECT_TRUE(holds(test::whatOf<DeviceError>([&] { Falcon(usb).open(); }), "name one by its USB socket"));
  Falcon other(usb, falconOptions(",1-1"));
  other.open();
  EXPECT_FALSE(left.received().empty());
  EXPECT_TRUE(holds(test::whatOf<DeviceError>([&] { Falcon(usb, {.bus_path = "9-9"}).open(); }), "9-9"));
  EXPECT_TRUE(holds(test::whatOf<DeviceError>([&] { Falcon(usb, {.bus_path = "1-2"}).open(); }), "another program"));
}

TEST(Falcon, TheBridgeIsAskedToHandReportsOnAtOnceOnlyIfWanted) {
  for (const bool wanted : {false, true}) {
    FakeUsb usb;
    FakeFalcon fake(usb);
    fake.powerUp(true);
    int asked = 0;
    const auto handled = fake.usb_device().on_control;
    fake.usb_device().on_control = [&](const UsbSetup& setup, std::span<std::uint8_t> data,
                                       test::FakeUsbDevice& device) {
      asked += setup.request == ftdi::kEventAtReportEnd.request && setup.value == ftdi::kEventAtReportEnd.value;
      return handled(setup, data, device);
    };
    Falcon falcon(usb, {.event_character = wanted});
    falcon.open();
    EXPECT_EQ(asked, wanted ? 1 : 0);
  }
}

}  // namespace
}  // namespace filiform
