#include "device/usb/usb_recording.h"

#include "device/falcon/falcon.h"
#include "device/spacemouse/spacemouse.h"
#include "tests/support/devices/device_states.h"
#include "tests/support/devices/fake_falcon.h"
#include "tests/support/devices/fake_usb.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::FakeFalcon;
using test::FakeUsb;
using test::FakeUsbDevice;
using test::sameBits;
using Bytes = std::vector<std::uint8_t>;

std::string usbMessageOf(const std::string& path) {
  try {
    UsbReplay replay(path);
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

// The states of a Falcon that is opened, homed and moved over this transport.
std::vector<DeviceState> drive(UsbTransport& usb, const std::function<void(int)>& each) {
  Falcon falcon(usb);
  falcon.open();
  std::vector<DeviceState> states;
  for (int i = 0; i < 1500; ++i) {
    each(i);
    Wrench wrench;
    wrench.force_N = {std::sin(0.01 * i), 0.5, -0.2};
    states.push_back(falcon.exchange(wrench));
  }
  falcon.close();
  return states;
}

TEST(UsbRecording, ADriverMeetsAgainWhatItMetOnce) {
  const test::TempFolder folder;
  std::vector<DeviceState> recorded;
  {
    FakeUsb usb;
    FakeFalcon fake(usb);
    fake.powerUp(true);
    fake.usb_device().fault({.kind = test::FakeUsbFault::Kind::lost, .at = 400});
    fake.usb_device().fault({.kind = test::FakeUsbFault::Kind::garbage, .at = 500});
    fake.usb_device().fault({.kind = test::FakeUsbFault::Kind::truncated, .at = 600, .bytes = 9});
    std::ofstream file(folder.file("falcon.usb"), std::ios::binary);
    UsbRecorder recorder(usb, file);
    recorded = drive(recorder, [&fake](int i) {
      if (i == 20) fake.home();
      fake.p_D = {0.01 * std::sin(0.02 * i), 0.01 * std::cos(0.02 * i), 1e-5 * i};
      fake.buttons = i % 300 < 20 ? 2 : 0;
    });
    recorder.finish();
    recorder.finish();
    EXPECT_TRUE(usb.violations().empty());
  }
  EXPECT_EQ(recorded.back().status, DeviceStatus::ready);
  UsbReplay replay(folder.file("falcon.usb"));
  const std::vector<DeviceState> replayed = drive(replay, [](int) {});
  ASSERT_EQ(replayed.size(), recorded.size());
  for (std::size_t i = 0; i < recorded.size(); ++i) ASSERT_TRUE(sameBits(recorded[i], replayed[i])) << i;
  EXPECT_EQ(replay.differing(), 0U);
  EXPECT_TRUE(replay.finished());
}

UsbDeviceInfo mouseInfo() {
  UsbDeviceInfo info;
  info.vendor = 0x256f;
  info.product = 0xc635;
  info.bus_path = "1-1.3";
  info.product_name = "a mouse";
  info.serial = std::string("\0\xff", 2);
  info.interfaces = {{0, 3, 0, 0, {{0x81, UsbEndpointType::interrupt, 8}}}};
  return info;
}

// Records a mouse that is moved and then unplugged.
std::string smallUsbRecording(const test::TempFolder& folder) {
  FakeUsb usb;
  FakeUsbDevice& device = usb.plug(mouseInfo());
  std::ofstream file(folder.file("small.usb"), std::ios::binary);
  UsbRecorder recorder(usb, file);
  SpaceMouse mouse(recorder);
  mouse.open();
  for (std::uint8_t i = 1; i <= 3; ++i) {
    device.answer(0x81, Bytes{1, i, 0, 0, 0, 0, 0});
    usb.pause(0.008);
    mouse.exchange({});
  }
  usb.unplug(device);
  EXPECT_EQ(mouse.exchange({}).status, DeviceStatus::fault);
  mouse.close();
  recorder.finish();
  return test::readBytes(folder.file("small.usb"));
}

TEST(UsbRecording, KeepsTheDeviceAndItsEnd) {
  const test::TempFolder folder;
  smallUsbRecording(folder);
  UsbReplay replay(folder.file("small.usb"));
  SpaceMouse mouse(replay, {.dead_zone = 0});
  mouse.open();
  EXPECT_EQ(mouse.status(), DeviceStatus::ready);
  replay.pause(0.03);
  DeviceState state = mouse.exchange({});
  EXPECT_EQ(state.status, DeviceStatus::fault) << "all of it came by then, the unplugging too";
  EXPECT_EQ(mouse.reports(), 3U);
  EXPECT_THROW(mouse.open(), UsbError) << "it has left for good";

  UsbReplay again(folder.file("small.usb"));
  const std::vector<UsbDeviceInfo> all = again.devices();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(describe(all[0]), "1-1.3 256f:c635 a mouse");
  EXPECT_EQ(all[0].serial, mouseInfo().serial);
  EXPECT_EQ(all[0].interfaces.at(0).endpoints.at(0).address, 0x81);
}

TEST(UsbRecording, CountsWhatADriverDoesOtherwise) {
  const test::TempFolder folder;
  FakeUsb usb;
  FakeUsbDevice& device = usb.plug(test::fakeBulkDevice(1, 2, "1-1", ""));
  device.on_control = [](const UsbSetup&, std::span<std::uint8_t> data, FakeUsbDevice&) {
    if (!data.empty()) data[0] = 77;
    return std::optional<std::size_t>(data.size());
  };
  const auto session = [](UsbTransport& transport, std::uint8_t first, std::uint8_t request) {
    const auto connection = transport.open(transport.devices().at(0));
    connection->claim(0);
    std::uint8_t answer[2] = {};
    connection->control({0xc0, request, 0, 0}, answer, 1);
    EXPECT_EQ(answer[0], 77);
    const auto out = connection->makeTransfer(0x02, 8);
    out->buffer()[0] = first;
    return connection->run(*out, 4, 1);
  };
  {
    std::ofstream file(folder.file("r.usb"), std::ios::binary);
    UsbRecorder recorder(usb, file);
    EXPECT_EQ(session(recorder, 1, 5), UsbStatus::done);
  }
  {
    UsbReplay replay(folder.file("r.usb"));
    EXPECT_EQ(session(replay, 1, 5), UsbStatus::done);
    EXPECT_EQ(replay.differing(), 0U);
    EXPECT_TRUE(replay.finished());
  }
  UsbReplay replay(folder.file("r.usb"));
  EXPECT_EQ(session(replay, 2, 5), UsbStatus::done);
  EXPECT_EQ(replay.differing(), 1U);
  UsbReplay other(folder.file("r.usb"));
  EXPECT_THROW(session(other, 1, 6), UsbError);
  EXPECT_EQ(other.differing(), 1U);
  EXPECT_FALSE(other.finished());
}

TEST(UsbRecording, KeepsRefusals) {
  const test::TempFolder folder;
  FakeUsb usb;
  FakeUsbDevice& device = usb.plug(test::fakeBulkDevice(1, 2, "1-1", ""));
  device.on_control = [](const UsbSetup&, std::span<std::uint8_t>, FakeUsbDevice&) { return std::nullopt; };
  const auto causes = [&device](UsbTransport& transport) {
    std::vector<UsbCause> seen;
    const auto note = [&seen](const auto& call) {
      try {
        call();
      } catch (const UsbError& error) {
        seen.push_back(error.cause());
      }
    };
    const UsbDeviceInfo info = transport.devices().at(0);
    device.permitted = false;
    note([&] { transport.open(info); });
    device.permitted = true;
    const auto connection = transport.open(info);
    device.busy = {0};
    note([&] { connection->claim(0); });
    device.busy.clear();
    note([&] { connection->control({0x40, 1, 0, 0}, {}, 1); });
    return seen;
  };
  const std::vector<UsbCause> expected{UsbCause::no_permission, UsbCause::busy, UsbCause::stalled};
  {
    std::ofstream file(folder.file("r.usb"), std::ios::binary);
    UsbRecorder recorder(usb, file);
    EXPECT_EQ(causes(recorder), expected);
  }
  UsbReplay replay(folder.file("r.usb"));
  EXPECT_EQ(causes(replay), expected);
}

TEST(UsbRecording, RefusesDamageAtEveryByte) {
  const test::TempFolder folder;
  const std::string whole = smallUsbRecording(folder);
  ASSERT_EQ(usbMessageOf(folder.file("small.usb")), "");
  const std::string path = folder.file("damaged.usb");
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    test::writeBytes(path, bytes);
    ASSERT_NE(usbMessageOf(path), "") << "byte " << at;
  }
  for (std::size_t length = 0; length < whole.size(); ++length) {
    test::writeBytes(path, whole.substr(0, length));
    const std::string message = usbMessageOf(path);
    ASSERT_NE(message.find("cut short at byte " + std::to_string(length)), std::string::npos) << message;
  }
  test::writeBytes(path, whole + "x");
  EXPECT_NE(usbMessageOf(path), "");
  std::string newer = whole;
  newer[8] = 9;
  test::writeBytes(path, newer);
  EXPECT_NE(usbMessageOf(path).find("version 9, this program reads version 1"), std::string::npos)
      << usbMessageOf(path);
  test::writeBytes(path, "FILIREC");
  EXPECT_NE(usbMessageOf(path).find("not a recording of USB traffic"), std::string::npos);
  EXPECT_NE(usbMessageOf(folder.file("none")).find("cannot open"), std::string::npos);
}

TEST(UsbRecording, SaysWhatItHadNoRoomFor) {
  const test::TempFolder folder;
  FakeUsb usb;
  FakeUsbDevice& device = usb.plug(mouseInfo());
  std::ofstream file(folder.file("r.usb"), std::ios::binary);
  UsbRecorder recorder(usb, file, 4096);
  SpaceMouse mouse(recorder);
  mouse.open();
  for (int i = 0; i < 200; ++i) {
    device.answer(0x81, Bytes{1, 1, 0, 0, 0, 0, 0});
    usb.pause(0.001);
    mouse.exchange({});
  }
  EXPECT_EQ(mouse.reports(), 200U) << "the driver does not notice";
  mouse.close();
  try {
    recorder.finish();
    ADD_FAILURE();
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("exceeded its capacity"), std::string::npos) << error.what();
  }
  EXPECT_EQ(usbMessageOf(folder.file("r.usb")), "") << "what it holds is whole";
  EXPECT_LE(std::filesystem::file_size(folder.file("r.usb")), 4096U);
  std::ofstream none(folder.file("no/such/r.usb"), std::ios::binary);
  EXPECT_THROW(UsbRecorder(usb, none).finish(), DeviceError);
}

TEST(UsbRecording, RecordingAllocatesNothingInTheLoop) {
  const test::TempFolder folder;
  FakeUsb usb;
  FakeUsbDevice& device = usb.plug(mouseInfo());
  std::ofstream file(folder.file("r.usb"), std::ios::binary);
  UsbRecorder recorder(usb, file);
  SpaceMouse mouse(recorder);
  mouse.open();
  for (int i = 0; i < 100; ++i) device.answer(0x81, Bytes{1, 1, 0, 0, 0, 0, 0}, 0.001 * i);
  test::NoAllocGuard guard;
  for (int i = 0; i < 150; ++i) {
    usb.pause(0.001);
    mouse.exchange({});
  }
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0U) << calls.first;
  EXPECT_EQ(mouse.reports(), 100U);
}

}  // namespace
}  // namespace filiform
