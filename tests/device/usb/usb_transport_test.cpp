#include "device/usb/usb_transport.h"

#include "tests/support/devices/fake_usb.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::fakeBulkDevice;
using test::FakeUsb;
using test::FakeUsbDevice;

TEST(UsbWatch, ReportsArrivalsAndDepartures) {
  FakeUsb usb;
  UsbWatch watch(usb);
  EXPECT_TRUE(watch.poll().empty());
  FakeUsbDevice& a = usb.plug(fakeBulkDevice(1, 2, "1-1", ""));
  usb.plug(fakeBulkDevice(1, 2, "1-2", ""));
  auto changes = watch.poll();
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_TRUE(changes[0].arrived);
  EXPECT_EQ(changes[0].device.bus_path, "1-1");
  EXPECT_TRUE(watch.poll().empty());
  usb.unplug(a);
  usb.plug(fakeBulkDevice(1, 2, "1-1", ""));
  changes = watch.poll();
  ASSERT_EQ(changes.size(), 2U) << "the same socket, another plug";
  EXPECT_FALSE(changes[0].arrived);
  EXPECT_TRUE(changes[1].arrived);
  EXPECT_NE(changes[0].device.address, changes[1].device.address);
}

TEST(UsbTransport, DescribesADevice) {
  EXPECT_EQ(describe(fakeBulkDevice(0x0403, 0xcb48, "1-2.4", "FALCON HAPTIC")), "1-2.4 0403:cb48 FALCON HAPTIC");
  EXPECT_EQ(describe(fakeBulkDevice(0x46d, 0xc626, "3-1", "")), "3-1 046d:c626");
}

}  // namespace
}  // namespace filiform
