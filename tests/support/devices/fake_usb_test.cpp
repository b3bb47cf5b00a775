#include "tests/support/devices/fake_usb.h"

#include "tests/support/no_alloc_guard.h"

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using FaultKind = FakeUsbFault::Kind;

// A device that echoes every write after 1 ms.
class FakeUsbTest : public testing::Test {
 protected:
  FakeUsbTest() : device(usb.plug(fakeBulkDevice(0x1234, 0x5678, "1-2", "echo"))) {
    device.on_write = [](std::uint8_t, std::span<const std::uint8_t> bytes, FakeUsbDevice& d) {
      d.answer(0x81, bytes, 0.001);
    };
  }
  ~FakeUsbTest() override {
    for (const std::string& text : usb.violations()) ADD_FAILURE() << text;
  }

  void open() {
    connection = usb.open(usb.devices().at(0));
    connection->claim(0);
    out = connection->makeTransfer(0x02, 64);
    in = connection->makeTransfer(0x81, 64);
  }
  UsbStatus write(const Bytes& bytes) {
    std::copy(bytes.begin(), bytes.end(), out->buffer().begin());
    return connection->run(*out, bytes.size(), 0.01);
  }
  // Returns the bytes received; if none, `status` says why.
  Bytes read() {
    status = connection->run(*in, 64, 0.01);
    const std::span<const std::uint8_t> data = in->data();
    return {data.begin(), data.end()};
  }

  FakeUsb usb;
  FakeUsbDevice& device;
  std::unique_ptr<UsbConnection> connection;
  std::unique_ptr<UsbTransfer> out, in;
  UsbStatus status = UsbStatus::idle;
};

TEST_F(FakeUsbTest, AnswersInVirtualTime) {
  open();
  EXPECT_EQ(write({1, 2, 3}), UsbStatus::done);
  EXPECT_EQ(out->actual(), 3U);
  EXPECT_DOUBLE_EQ(usb.time_s(), 0.0001);
  EXPECT_EQ(read(), (Bytes{1, 2, 3}));
  EXPECT_DOUBLE_EQ(usb.time_s(), 0.0011);
  read();
  EXPECT_EQ(status, UsbStatus::timed_out);
  EXPECT_DOUBLE_EQ(usb.time_s(), 0.0111);
  usb.pause(1);
  EXPECT_DOUBLE_EQ(connection->time_s(), 1.0111);
}

TEST_F(FakeUsbTest, CompletesReadsInTheOrderOfTheirSubmission) {
  open();
  const auto second = connection->makeTransfer(0x81, 64);
  in->submit(64);
  second->submit(64);
  write({1});
  write({2});
  EXPECT_TRUE(connection->handleEvents(0.01));
  EXPECT_EQ(in->data()[0], 1);
  EXPECT_TRUE(second->pending());
  EXPECT_TRUE(connection->handleEvents(0.01));
  EXPECT_EQ(second->data()[0], 2);
  EXPECT_FALSE(connection->handleEvents(0.01));
}

TEST_F(FakeUsbTest, CancelsAReadAndKeepsTheNextPacket) {
  open();
  in->submit(64);
  in->cancel();
  EXPECT_EQ(in->status(), UsbStatus::cancelled);
  write({7});
  EXPECT_EQ(read(), Bytes{7});
}

TEST_F(FakeUsbTest, ATransferThatTheSystemDoesNotReturnIsWaitedForAsLongAsTold) {
  open();
  device.fault({.kind = FaultKind::stuck, .at = device.transfers()});
  ASSERT_TRUE(in->submit(64));
  double begin_s = usb.time_s();
  EXPECT_FALSE(in->cancel(0.02));
  EXPECT_NEAR(usb.time_s() - begin_s, 0.02, 1e-9);
  EXPECT_TRUE(in->pending());
  begin_s = usb.time_s();
  EXPECT_EQ(connection->run(*out, 4, 0.01, 0.005), UsbStatus::pending);
  EXPECT_NEAR(usb.time_s() - begin_s, 0.015, 1e-9);
}

TEST_F(FakeUsbTest, PacketsThatFindTheQueueFullAreLostAndCounted) {
  usb.queue_packets = 3;
  FakeUsbDevice& narrow = usb.plug(fakeBulkDevice(0x1234, 0x5679, "1-3", "three packets"));
  for (std::uint8_t i = 0; i < 5; ++i) narrow.answer(0x81, Bytes{i});
  EXPECT_EQ(narrow.lost(), 2U);
  for (std::uint8_t i = 0; i < 5; ++i) device.answer(0x81, Bytes{i});
  EXPECT_EQ(device.lost(), 0U) << "plugged in before";
}

TEST_F(FakeUsbTest, DamagesThePacketsItIsToldTo) {
  device.fault({.kind = FaultKind::truncated, .at = 1, .bytes = 2});
  device.fault({.kind = FaultKind::split, .at = 2, .bytes = 1});
  device.fault({.kind = FaultKind::merged, .at = 3});
  device.fault({.kind = FaultKind::lost, .at = 5});
  device.fault({.kind = FaultKind::garbage, .at = 6});
  device.fault({.kind = FaultKind::silent, .at = 8});
  open();
  for (std::uint8_t i = 0; i < 9; ++i) write({i, 10, 20});
  EXPECT_EQ(read(), (Bytes{0, 10, 20}));
  EXPECT_EQ(read(), (Bytes{1, 10}));
  EXPECT_EQ(read(), (Bytes{2}));
  EXPECT_EQ(read(), (Bytes{10, 20}));
  EXPECT_EQ(read(), (Bytes{3, 10, 20, 4, 10, 20}));
  const Bytes garbage = read();
  EXPECT_EQ(garbage.size(), 3U);
  EXPECT_NE(garbage, (Bytes{6, 10, 20}));
  EXPECT_EQ(read(), (Bytes{7, 10, 20}));
  read();
  EXPECT_EQ(status, UsbStatus::timed_out);
}

TEST_F(FakeUsbTest, EndsTheTransfersItIsToldTo) {
  device.fault({.kind = FaultKind::stalled, .at = 0});
  device.fault({.kind = FaultKind::failed, .at = 2});
  device.fault({.kind = FaultKind::deaf, .at = 4});
  open();
  EXPECT_EQ(write({1}), UsbStatus::stalled);
  EXPECT_EQ(write({1}), UsbStatus::done);
  read();
  EXPECT_EQ(status, UsbStatus::failed);
  EXPECT_EQ(read(), Bytes{1});
  EXPECT_EQ(write({1}), UsbStatus::timed_out);
  EXPECT_THROW(connection->control({0x40, 0, 0, 0}, {}, 0.1), UsbError);
}

TEST_F(FakeUsbTest, IsUnpluggedAtATransferOrATime) {
  device.fault({.kind = FaultKind::unplugged, .at = 3});
  open();
  in->submit(64);
  EXPECT_EQ(write({1}), UsbStatus::done);
  EXPECT_EQ(write({2}), UsbStatus::done);
  EXPECT_FALSE(connection->gone());
  EXPECT_EQ(write({3}), UsbStatus::gone);
  EXPECT_TRUE(connection->gone());
  connection->handleEvents(0);
  EXPECT_TRUE(usb.devices().empty());
  EXPECT_THROW(connection->claim(0), UsbError);

  FakeUsbDevice& other = usb.plug(fakeBulkDevice(1, 2, "1-3", ""));
  const auto again = usb.open(usb.devices().at(0));
  again->claim(0);
  const auto reader = again->makeTransfer(0x81, 64);
  usb.unplugAt(other, usb.time_s() + 0.005);
  const double start_s = usb.time_s();
  EXPECT_EQ(again->run(*reader, 64, 1), UsbStatus::gone);
  EXPECT_NEAR(usb.time_s() - start_s, 0.005, 1e-12) << "seen when it happens";
}

TEST_F(FakeUsbTest, RefusesByCause) {
  const auto causeOf = [](const auto& call) {
    try {
      call();
    } catch (const UsbError& error) {
      return error.cause();
    }
    return UsbCause::failed;
  };
  const UsbDeviceInfo info = usb.devices().at(0);
  device.permitted = false;
  EXPECT_FALSE(usb.devices().at(0).may_open);
  EXPECT_EQ(causeOf([&] { usb.open(info); }), UsbCause::no_permission);
  device.permitted = true;
  device.busy = {0};
  connection = usb.open(info);
  EXPECT_EQ(causeOf([&] { connection->claim(0); }), UsbCause::busy);
  device.busy.clear();
  connection->claim(0);
  const auto second = usb.open(info);
  EXPECT_EQ(causeOf([&] { second->claim(0); }), UsbCause::busy);
  device.on_control = [](const UsbSetup&, std::span<std::uint8_t>, FakeUsbDevice&) { return std::nullopt; };
  EXPECT_EQ(causeOf([&] { connection->control({}, {}, 1); }), UsbCause::stalled);
  usb.unplug(device);
  EXPECT_EQ(causeOf([&] { usb.open(info); }), UsbCause::not_found);
  EXPECT_EQ(causeOf([&] { connection->control({}, {}, 1); }), UsbCause::gone);
}

TEST_F(FakeUsbTest, GivesTheInterfaceBackToItsKernelDriver) {
  device.kernel_driven = {0};
  open();
  EXPECT_TRUE(device.kernel_driven.empty());
  EXPECT_EQ(device.claimed(), Bytes{0});
  in.reset();
  out.reset();
  connection.reset();
  EXPECT_EQ(device.kernel_driven, Bytes{0});
  EXPECT_TRUE(device.claimed().empty());
}

TEST_F(FakeUsbTest, AnswersReadsThatFindNothing) {
  device.on_read = [](std::uint8_t endpoint, FakeUsbDevice& d) { d.answer(endpoint, Bytes{1, 96}, 0.016); };
  open();
  EXPECT_EQ(read(), Bytes{}) << "not within 10 ms";
  EXPECT_EQ(read(), (Bytes{1, 96}));
  EXPECT_DOUBLE_EQ(usb.time_s(), 0.016);
}

TEST_F(FakeUsbTest, AllocatesNothingOnceOpened) {
  open();
  in->submit(64);
  NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    out->buffer()[0] = 1;
    out->submit(16);
    while (out->pending() || in->pending()) connection->handleEvents(0.01);
    in->submit(64);
  }
  const ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0U) << calls.first;
  EXPECT_EQ(device.packets(), 100U);
}

TEST(FakeUsb, NoticesMisuse) {
  FakeUsb usb;
  usb.plug(fakeBulkDevice(1, 2, "1-1", ""));
  std::unique_ptr<UsbConnection> connection = usb.open(usb.devices().at(0));
  {
    const auto out = connection->makeTransfer(0x02, 8);
    EXPECT_FALSE(out->submit(8));
    EXPECT_EQ(usb.violations().size(), 1U) << "not claimed";
    connection->claim(0);
    const std::span<std::uint8_t> buffer = out->buffer();
    out->submit(8);
    EXPECT_FALSE(out->submit(8));
    EXPECT_EQ(usb.violations().size(), 2U) << "pending";
    buffer[3] ^= 1;
    connection->handleEvents(1);
    EXPECT_EQ(usb.violations().size(), 3U) << "changed in flight";
  }
  EXPECT_THROW(connection->makeTransfer(0x83, 8), UsbError);
  EXPECT_EQ(usb.violations().size(), 3U);
}

}  // namespace
}  // namespace filiform::test
