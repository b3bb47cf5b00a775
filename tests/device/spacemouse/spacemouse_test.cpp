#include "device/spacemouse/spacemouse.h"

#include "device/spacemouse/internal/spacemouse_reports.h"
#include "tests/support/devices/fake_usb.h"
#include "tests/support/no_alloc_guard.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::FakeUsb;
using test::FakeUsbDevice;
using Bytes = std::vector<std::uint8_t>;

Bytes report(std::uint8_t id, std::initializer_list<int> values) {
  Bytes bytes{id};
  for (const int value : values) {
    bytes.push_back(static_cast<std::uint8_t>(value & 0xff));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8 & 0xff));
  }
  return bytes;
}

UsbInterface hid(std::uint8_t number, std::uint8_t endpoint, std::uint8_t protocol = 0, std::uint8_t out = 0) {
  UsbInterface interface {
    number, 3, static_cast<std::uint8_t>(protocol != 0 ? 1 : 0), protocol, {}
  };
  interface.endpoints.push_back({static_cast<std::uint8_t>(0x80 | endpoint), UsbEndpointType::interrupt, 8});
  if (out != 0) interface.endpoints.push_back({out, UsbEndpointType::interrupt, 8});
  return interface;
}

UsbDeviceInfo mouseAt(const std::string& bus_path, std::uint16_t vendor = 0x046d, std::uint16_t product = 0xc626) {
  UsbDeviceInfo info;
  info.vendor = vendor;
  info.product = product;
  info.bus_path = bus_path;
  info.product_name = "SpaceNavigator";
  info.interfaces = {hid(0, 1)};
  return info;
}

// Without a dead zone, full deflection is 0.1 m/s and 1 rad/s.
class SpaceMouseTest : public testing::Test {
 protected:
  ~SpaceMouseTest() override {
    mouse.close();
    for (const std::string& text : usb.violations()) ADD_FAILURE() << text;
  }
  DeviceState after(double seconds) {
    usb.pause(seconds);
    return mouse.exchange({});
  }

  FakeUsb usb;
  SpaceMouse mouse{usb, {.dead_zone = 0}};
};

TEST_F(SpaceMouseTest, UnderstandsBothFormatsByTheirLength) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  mouse.open();
  EXPECT_EQ(mouse.status(), DeviceStatus::ready);
  device.answer(0x81, report(1, {350, 70, -35}));
  DeviceState state = after(0.008);
  EXPECT_NEAR((state.v_D - Vector3d(0.1, 0.01, 0.02)).norm(), 0, 1e-15) << "x right, -z up, y towards the person";
  EXPECT_EQ(state.twist_D, Vector3d::Zero());
  device.answer(0x81, report(2, {0, -350, 175}));
  state = after(0.008);
  EXPECT_NEAR((state.twist_D - Vector3d(0, -0.5, -1)).norm(), 0, 1e-15);
  EXPECT_NEAR(state.v_D.x(), 0.1, 1e-15) << "the split format sends them in turn";

  device.answer(0x81, report(1, {0, 0, -350, 350, 0, 0}));
  state = after(0.008);
  EXPECT_NEAR((state.v_D - Vector3d(0, 0.1, 0)).norm(), 0, 1e-15);
  EXPECT_NEAR((state.twist_D - Vector3d(1, 0, 0)).norm(), 0, 1e-15);
  EXPECT_EQ(mouse.reports(), 3U);
  EXPECT_NEAR(state.time_s, 0.024, 0.001);
}

TEST_F(SpaceMouseTest, ClampsAndLeavesADeadZone) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  SpaceMouse soft(usb, {.full_speed_m_s = 0.2, .dead_zone = 0.1});
  soft.open();
  device.answer(0x81, report(1, {32767, 35, -36}));
  usb.pause(0.001);
  const DeviceState state = soft.exchange({});
  EXPECT_NEAR(state.v_D.x(), 0.2, 1e-15);
  EXPECT_EQ(state.v_D.z(), 0);
  EXPECT_GT(state.v_D.y(), 0);
  EXPECT_LT(state.v_D.y(), 0.001) << "it begins at the edge of the zone without a step";
}

TEST_F(SpaceMouseTest, TakesSilenceForRest) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  mouse.open();
  device.answer(0x81, report(1, {350, 0, 0, 350, 0, 0}));
  EXPECT_NE(after(0.001).v_D, Vector3d::Zero());
  device.answer(0x81, Bytes{3, 1, 0});
  EXPECT_NE(after(0.099).v_D, Vector3d::Zero());
  const DeviceState rest = after(0.003);
  EXPECT_EQ(rest.v_D, Vector3d::Zero()) << "a button is no motion";
  EXPECT_EQ(rest.twist_D, Vector3d::Zero());
  EXPECT_EQ(rest.buttons, 1U) << "but it is still held";
  EXPECT_EQ(rest.status, DeviceStatus::ready);
}

TEST_F(SpaceMouseTest, ReadsButtonsAndIgnoresTheRest) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  mouse.open();
  device.answer(0x81, Bytes{3, 0x02, 0});
  EXPECT_EQ(after(0.001).buttons, 2U);
  device.answer(0x81, Bytes{3, 0, 0x10, 0, 0x80, 0, 0});
  EXPECT_EQ(after(0.001).buttons, 0x80001000U);
  for (const Bytes& odd : {Bytes{0x17, 50, 0}, Bytes{0x19, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, Bytes{},
                           report(1, {350, 0}), Bytes{3}, Bytes{2, 0, 1}})
    device.answer(0x81, odd);
  const DeviceState state = after(0.001);
  EXPECT_EQ(state.buttons, 0x80001000U);
  EXPECT_EQ(state.v_D, Vector3d::Zero());
  EXPECT_EQ(mouse.reports(), 2U);
}

TEST_F(SpaceMouseTest, ListensOnEveryInterfaceOfAReceiverButThePlainMouse) {
  UsbDeviceInfo receiver = mouseAt("1-1", 0x256f, 0xc652);
  receiver.interfaces = {hid(0, 1), hid(1, 2), hid(2, 3, 2), hid(3, 4)};
  FakeUsbDevice& device = usb.plug(receiver);
  mouse.open();
  EXPECT_EQ(device.claimed(), (Bytes{0, 1, 3}));
  device.answer(0x82, report(1, {350, 0, 0, 0, 0, 0}));
  device.answer(0x84, Bytes{3, 4, 0});
  const DeviceState state = after(0.001);
  EXPECT_NEAR(state.v_D.x(), 0.1, 1e-15);
  EXPECT_EQ(state.buttons, 4U);
}

TEST_F(SpaceMouseTest, LightsItsLed) {
  UsbDeviceInfo info = mouseAt("1-1");
  info.interfaces = {hid(0, 1, 0, 0x02)};
  FakeUsbDevice& with_out = usb.plug(info);
  std::vector<Bytes> written;
  with_out.on_write = [&written](std::uint8_t endpoint, std::span<const std::uint8_t> bytes, FakeUsbDevice&) {
    EXPECT_EQ(endpoint, 2);
    written.emplace_back(bytes.begin(), bytes.end());
  };
  mouse.open();
  mouse.close();
  EXPECT_EQ(written, (std::vector<Bytes>{{4, 1}, {4, 0}}));
  usb.unplug(with_out);

  FakeUsbDevice& without = usb.plug(mouseAt("1-1"));
  std::vector<int> asked;
  without.on_control = [&asked](const UsbSetup& setup, std::span<std::uint8_t> data, FakeUsbDevice&) {
    EXPECT_EQ(setup.request_type, 0x21);
    EXPECT_EQ(setup.request, 0x09);
    EXPECT_EQ(setup.value, 0x0204);
    asked.push_back(data[1]);
    return std::optional<std::size_t>();  // refused: the lamp is not essential
  };
  mouse.open();
  EXPECT_EQ(mouse.status(), DeviceStatus::ready);
  mouse.close();
  EXPECT_EQ(asked, (std::vector<int>{1, 0}));
}

TEST_F(SpaceMouseTest, TakesWhatCameWhileItLitItsLed) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  for (int i = 1; i <= 3; ++i) device.answer(0x81, report(1, {i, 0, 0}));
  mouse.open();
  EXPECT_NEAR(after(0).v_D.x(), 0.1 * 3 / 350, 1e-15);
  EXPECT_EQ(mouse.reports(), 3U);
}

TEST_F(SpaceMouseTest, ComesToRestInFaultWhenUnplugged) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  device.kernel_driven = {0};
  mouse.open();
  device.answer(0x81, report(1, {350, 0, 0, 350, 0, 0}));
  device.answer(0x81, Bytes{3, 1, 0});
  EXPECT_NE(after(0.001).buttons, 0U);
  usb.unplug(device);
  for (int i = 0; i < 3; ++i) {
    const DeviceState state = after(0.001);
    EXPECT_EQ(state.status, DeviceStatus::fault);
    EXPECT_EQ(state.v_D, Vector3d::Zero());
    EXPECT_EQ(state.twist_D, Vector3d::Zero());
    EXPECT_EQ(state.buttons, 0U);
  }
  EXPECT_THROW(mouse.open(), UsbError);
  EXPECT_EQ(mouse.status(), DeviceStatus::closed);
  FakeUsbDevice& again = usb.plug(mouseAt("1-4"));
  again.kernel_driven = {0};
  mouse.open();
  again.answer(0x81, report(1, {350, 0, 0}));
  EXPECT_NE(after(0.001).v_D, Vector3d::Zero());
  mouse.close();
  EXPECT_EQ(again.kernel_driven, Bytes{0}) << "the kernel has it back";
}

TEST_F(SpaceMouseTest, EndsInTheRightStateWhereverItIsUnplugged) {
  for (std::uint64_t k = 0; k < 40; ++k) {
    FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
    device.fault({.kind = test::FakeUsbFault::Kind::unplugged, .at = k});
    for (int i = 0; i < 60; ++i) device.answer(0x81, report(1, {350, 0, 0}), 0.002 * i);
    bool opened = true;
    try {
      mouse.open();
    } catch (const UsbError& error) {
      opened = false;
      EXPECT_EQ(error.cause(), UsbCause::gone);
      EXPECT_EQ(mouse.status(), DeviceStatus::closed);
    }
    DeviceState state;
    for (int i = 0; opened && i < 100; ++i) state = after(0.001);
    EXPECT_EQ(opened, k > 0);
    if (opened) {
      EXPECT_EQ(state.status, DeviceStatus::fault);
    }
    EXPECT_EQ(state.v_D, Vector3d::Zero()) << k;
    mouse.close();
    usb.unplug(device);
  }
}

TEST_F(SpaceMouseTest, ChoosesBySocketAndSaysWhatIsMissing) {
  EXPECT_THROW(mouse.open(), UsbError);
  FakeUsbDevice& first = usb.plug(mouseAt("1-1"));
  FakeUsbDevice& second = usb.plug(mouseAt("1-2"));
  SpaceMouse other(usb, {.bus_path = "1-2"});
  other.open();
  EXPECT_TRUE(first.claimed().empty());
  EXPECT_EQ(second.claimed(), Bytes{0});
  EXPECT_THROW(SpaceMouse(usb, {.bus_path = "1-3"}).open(), UsbError);
  first.permitted = false;
  try {
    mouse.open();
    ADD_FAILURE();
  } catch (const UsbError& error) {
    EXPECT_EQ(error.cause(), UsbCause::no_permission);
  }
  EXPECT_THROW(SpaceMouse(usb, {.silence_s = NAN}), DeviceError);
  EXPECT_THROW(SpaceMouse(usb, {.dead_zone = 1}), DeviceError);
}

TEST_F(SpaceMouseTest, KnowsItsKind) {
  EXPECT_TRUE(isSpaceMouse(mouseAt("1-1")));
  EXPECT_TRUE(isSpaceMouse(mouseAt("1-1", 0x256f, 0xc635)));
  EXPECT_FALSE(isSpaceMouse(mouseAt("1-1", 0x256f, 0xc650))) << "a CadMouse";
  EXPECT_FALSE(isSpaceMouse(mouseAt("1-1", 0x046d, 0xc077))) << "any mouse of Logitech's";
  EXPECT_FALSE(isSpaceMouse(mouseAt("1-1", 0x0403, 0xcb48)));
}

TEST_F(SpaceMouseTest, ExchangeAllocatesNothing) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  mouse.open();
  for (int i = 0; i < 500; ++i) device.answer(0x81, report(1 + i % 2, {i, -i, 350}), 0.001 * i);
  test::NoAllocGuard guard;
  for (int i = 0; i < 600; ++i) after(0.001);
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0U) << calls.first;
  EXPECT_EQ(mouse.reports(), 500U);
}

TEST_F(SpaceMouseTest, CatchesUpWithALoopThatIsSlowerThanTheMouse) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  mouse.open();
  for (int i = 1; i <= 20; ++i) device.answer(0x81, report(1, {i, 0, 0}), 0.001 * i);
  EXPECT_NEAR(after(0.02).v_D.x(), 0.1 * 20 / 350, 1e-15) << "the newest counts";
}

bool sane(const DeviceState& state) {
  return state.v_D.allFinite() && state.twist_D.allFinite() && state.v_D.cwiseAbs().maxCoeff() <= 0.1 &&
         state.twist_D.cwiseAbs().maxCoeff() <= 1 && state.p_D == Vector3d::Zero();
}

TEST(SpaceMouseReports, StayInRangeForAMillionRandomStreams) {
  std::mt19937 random(5);
  std::array<std::uint8_t, 20> bytes{};
  for (int stream = 0; stream < 1'000'000; ++stream) {
    internal::SpaceMouseState state;
    for (std::uint32_t left = random() % 4; left < 4; ++left) {
      for (std::size_t i = 0; i < bytes.size(); i += 4) {
        const auto word = static_cast<std::uint32_t>(random());
        for (std::size_t k = 0; k < 4; ++k) bytes[i + k] = static_cast<std::uint8_t>(word >> 8 * k);
      }
      if (bytes[19] < 200) bytes[0] = bytes[0] & 3;
      internal::takeReport({bytes.data(), bytes[18] % 20U}, state);
    }
    for (const double axis : state.axes) ASSERT_TRUE(std::abs(axis) <= 1) << "stream " << stream;
  }
}

TEST_F(SpaceMouseTest, StaysSaneWithAnyReports) {
  FakeUsbDevice& device = usb.plug(mouseAt("1-1"));
  mouse.open();
  std::mt19937 random(6);
  for (int i = 0; i < 20000; ++i) {
    Bytes bytes(random() % 20);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    if (!bytes.empty() && random() % 4 != 0) bytes[0] &= 3;
    device.answer(0x81, bytes);
    const DeviceState state = after(0.001 * (random() % 3));
    ASSERT_TRUE(sane(state)) << i;
    ASSERT_EQ(state.status, DeviceStatus::ready);
  }
  EXPECT_GT(mouse.reports(), 5000U);
}

}  // namespace
}  // namespace filiform
