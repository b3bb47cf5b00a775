// systemUsb() on the real libusb, with umockdev for the kernel. Nothing is said about speed: see mock_usb.h.
#include "device/usb/usb_transport.h"
#include "tests/groups/umockdev/mock_usb.h"

#include <algorithm>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::MockBytes;
using test::MockUsb;
using test::MockUsbDevice;

UsbDeviceInfo describedAs(std::uint16_t vendor, std::uint16_t product, const std::string& bus_path) {
  UsbDeviceInfo info;
  info.vendor = vendor;
  info.product = product;
  info.bus_path = bus_path;
  info.manufacturer = "nobody";
  info.product_name = "echo";
  info.serial = "7";
  info.interfaces = {{0, 0xff, 0xff, 0xff, {{0x81, UsbEndpointType::bulk, 64}, {0x02, UsbEndpointType::bulk, 64}}},
                     {1, 3, 0, 0, {{0x83, UsbEndpointType::interrupt, 8}}}};
  return info;
}

class SystemUsb : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = MockUsb::missing(); !why.empty()) GTEST_SKIP() << why;
    usb = std::make_unique<MockUsb>();
    device = &plugEcho("1-2");
  }

  // Answers every write on 0x02 with its bytes on 0x81; request 5 IN gives 1 2 3, request 6 OUT is taken.
  MockUsbDevice& plugEcho(const std::string& bus_path) {
    MockUsbDevice& echo = usb->plug(describedAs(0x1234, 0x5678, bus_path));
    echo.onWrite([](std::uint8_t, const MockBytes& bytes, MockUsbDevice& d) { d.answer(0x81, bytes); });
    echo.onControl([](const UsbSetup& setup, const MockBytes&, MockUsbDevice&) -> std::optional<MockBytes> {
      if (setup.in() && setup.request == 5) return MockBytes{1, 2, 3};
      if (!setup.in() && setup.request == 6) return MockBytes{};
      return std::nullopt;
    });
    return echo;
  }

  static UsbDeviceInfo at(const std::string& bus_path) {
    for (const UsbDeviceInfo& info : systemUsb().devices())
      if (info.bus_path == bus_path) return info;
    throw UsbError(UsbCause::not_found, bus_path);
  }

  static UsbStatus write(UsbConnection& connection, UsbTransfer& out, const MockBytes& bytes) {
    std::copy(bytes.begin(), bytes.end(), out.buffer().begin());
    return connection.run(out, bytes.size(), 5);
  }

  template <typename Call>
  static void expectCause(UsbCause cause, const std::string& says, const Call& call) {
    try {
      call();
      ADD_FAILURE() << "nothing was thrown";
    } catch (const UsbError& error) {
      EXPECT_EQ(error.cause(), cause) << error.what();
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  }

  std::unique_ptr<MockUsb> usb;
  MockUsbDevice* device = nullptr;
};

TEST_F(SystemUsb, ListsWhatIsPluggedIn) {
  const auto all = systemUsb().devices();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(describe(all[0]), "1-2 1234:5678 echo");
  EXPECT_EQ(all[0].manufacturer, "nobody");
  EXPECT_EQ(all[0].serial, "7");
  EXPECT_TRUE(all[0].may_open);
  ASSERT_EQ(all[0].interfaces.size(), 2U);
  EXPECT_EQ(all[0].interfaces[0].endpoints.at(1).address, 0x02);
  EXPECT_EQ(all[0].interfaces[1].usb_class, 3);
  EXPECT_EQ(all[0].interfaces[1].endpoints.at(0).type, UsbEndpointType::interrupt);
  EXPECT_EQ(all[0].interfaces[1].endpoints.at(0).max_packet, 8);
}

TEST_F(SystemUsb, TakesAnInterfaceFromTheKernelAndGivesItBack) {
  device->bind(0, "some_driver");
  {
    const auto connection = systemUsb().open(at("1-2"));
    connection->claim(0);
    EXPECT_EQ(device->bound()[0], "usbfs");
    connection->claim(1);
    connection->release(1);
    connection->release(1);
    EXPECT_EQ(device->bound().count(1), 0U);
  }
  EXPECT_EQ(device->bound()[0], "some_driver");
}

TEST_F(SystemUsb, SaysThatAnotherProgramHasIt) {
  device->bind(0, "usbfs");
  const auto connection = systemUsb().open(at("1-2"));
  expectCause(UsbCause::busy, "another program", [&] { connection->claim(0); });
}

TEST_F(SystemUsb, AsksAndTellsByControlTransfers) {
  const auto connection = systemUsb().open(at("1-2"));
  std::uint8_t data[8] = {};
  EXPECT_EQ(connection->control({0xc0, 5, 0, 0}, data, 5), 3U);
  EXPECT_EQ(data[2], 3);
  EXPECT_EQ(connection->control({0x40, 6, 0x138, 0}, {}, 5), 0U);
  expectCause(UsbCause::stalled, "refused", [&] { connection->control({0x40, 7, 0, 0}, {}, 5); });
}

TEST_F(SystemUsb, MovesBytesBothWaysWithAReadAlwaysPosted) {
  const auto connection = systemUsb().open(at("1-2"));
  connection->claim(0);
  const auto out = connection->makeTransfer(0x02, 64);
  const auto in = connection->makeTransfer(0x81, 64);
  for (std::uint8_t i = 0; i < 50; ++i) {
    ASSERT_TRUE(in->submit(64));
    ASSERT_EQ(write(*connection, *out, {i, 2, 3, 4}), UsbStatus::done);
    EXPECT_EQ(out->actual(), 4U);
    for (int round = 0; in->pending() && round < 100; ++round) connection->handleEvents(0.1);
    ASSERT_EQ(in->status(), UsbStatus::done);
    ASSERT_EQ(in->data().size(), 4U);
    ASSERT_EQ(in->data()[0], i);
  }
  device->answer(0x81, MockBytes(32, 1));
  EXPECT_EQ(connection->run(*in, 16, 5), UsbStatus::overflow);
}

TEST_F(SystemUsb, ReadsInterruptEndpoints) {
  const auto connection = systemUsb().open(at("1-2"));
  connection->claim(1);
  const auto in = connection->makeTransfer(0x83, 8);
  device->answer(0x83, {9, 8, 7});
  EXPECT_EQ(connection->run(*in, 8, 5), UsbStatus::done);
  EXPECT_EQ(in->data().size(), 3U);
  expectCause(UsbCause::failed, "endpoint", [&] { connection->makeTransfer(0x84, 8); });
}

TEST_F(SystemUsb, EndsAReadWhenItsTimeIsUp) {
  const auto connection = systemUsb().open(at("1-2"));
  connection->claim(0);
  const auto in = connection->makeTransfer(0x81, 64);
  const double start_s = connection->time_s();
  EXPECT_FALSE(connection->handleEvents(0.02)) << "nothing is on its way";
  EXPECT_EQ(connection->run(*in, 64, 0.05), UsbStatus::timed_out);
  EXPECT_GE(connection->time_s() - start_s, 0.07);
  device->answer(0x81, {1});
  EXPECT_EQ(connection->run(*in, 64, 5), UsbStatus::done) << "and it can be used again";
}

TEST_F(SystemUsb, CancelsAndWaits) {
  const auto connection = systemUsb().open(at("1-2"));
  connection->claim(0);
  const auto in = connection->makeTransfer(0x81, 64);
  in->cancel();
  EXPECT_EQ(in->status(), UsbStatus::idle);
  ASSERT_TRUE(in->submit(64));
  EXPECT_FALSE(in->submit(64)) << "it is on its way";
  in->cancel();
  EXPECT_EQ(in->status(), UsbStatus::cancelled);
  EXPECT_EQ(in->actual(), 0U);
  ASSERT_TRUE(in->submit(64));  // pending when the connection ends
}

TEST_F(SystemUsb, SeesThatTheDeviceWasPulledOut) {
  const UsbDeviceInfo info = at("1-2");
  const auto connection = systemUsb().open(info);
  connection->claim(0);
  const auto in = connection->makeTransfer(0x81, 64);
  ASSERT_TRUE(in->submit(64));
  EXPECT_FALSE(connection->gone());
  usb->unplug(*device);
  for (int round = 0; in->pending() && round < 100; ++round) connection->handleEvents(0.1);
  EXPECT_EQ(in->status(), UsbStatus::gone);
  EXPECT_TRUE(connection->gone());
  EXPECT_FALSE(in->submit(64));
  EXPECT_EQ(in->status(), UsbStatus::gone);
  expectCause(UsbCause::gone, "unplugged", [&] { connection->control({0xc0, 5, 0, 0}, {}, 1); });
  expectCause(UsbCause::not_found, "no longer", [&] { systemUsb().open(info); });
}

TEST_F(SystemUsb, FindsADeviceThatWasPluggedInAgain) {
  UsbWatch watch(systemUsb());
  EXPECT_EQ(watch.poll().size(), 1U);
  const UsbDeviceInfo before = at("1-2");
  usb->unplug(*device);
  auto changes = watch.poll();
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_FALSE(changes[0].arrived);
  plugEcho("1-2");
  changes = watch.poll();
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_TRUE(changes[0].arrived);
  EXPECT_EQ(changes[0].device.bus_path, "1-2");
  EXPECT_FALSE(changes[0].device.samePlug(before));
  const auto connection = systemUsb().open(changes[0].device);
  connection->claim(0);
  const auto out = connection->makeTransfer(0x02, 64);
  EXPECT_EQ(write(*connection, *out, {1}), UsbStatus::done);
}

TEST_F(SystemUsb, KeepsTwoDevicesApart) {
  plugEcho("1-1");
  ASSERT_EQ(systemUsb().devices().size(), 2U);
  EXPECT_EQ(systemUsb().devices().front().bus_path, "1-1");
  std::vector<std::unique_ptr<UsbConnection>> connections;
  std::vector<std::unique_ptr<UsbTransfer>> reads;
  for (const char* path : {"1-1", "1-2"}) {
    connections.push_back(systemUsb().open(at(path)));
    connections.back()->claim(0);
    reads.push_back(connections.back()->makeTransfer(0x81, 64));
    ASSERT_TRUE(reads.back()->submit(64));
  }
  const auto out = connections[0]->makeTransfer(0x02, 64);
  EXPECT_EQ(write(*connections[0], *out, {42}), UsbStatus::done);
  EXPECT_FALSE(connections[1]->handleEvents(0.01));
  for (int round = 0; reads[0]->pending() && round < 100; ++round) connections[0]->handleEvents(0.1);
  EXPECT_EQ(reads[0]->status(), UsbStatus::done);
  EXPECT_TRUE(reads[1]->pending());
  usb->unplug(*device);
  for (int round = 0; reads[1]->pending() && round < 100; ++round) connections[1]->handleEvents(0.1);
  EXPECT_TRUE(connections[1]->gone());
  EXPECT_EQ(write(*connections[0], *out, {43}), UsbStatus::done) << "the other one is not touched";
  reads.clear();
}

// Root may open everything: as nobody for a while.
class AsNobody {
 public:
  AsNobody() : root_(geteuid() == 0), done_(!root_ || setresuid(65534, 65534, 0) == 0) {}
  ~AsNobody() {
    if (root_ && setresuid(0, 0, 0) != 0) ADD_FAILURE() << "root again";
  }
  bool done() const { return done_; }

 private:
  bool root_, done_;
};

TEST_F(SystemUsb, NamesTheRuleThatGivesPermission) {
  usb->forbid(*device);
  const AsNobody nobody;
  ASSERT_TRUE(nobody.done());
  const auto all = systemUsb().devices();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_FALSE(all[0].may_open);
  expectCause(UsbCause::no_permission, kUdevRule, [&] { systemUsb().open(all[0]); });
}

}  // namespace
}  // namespace filiform
