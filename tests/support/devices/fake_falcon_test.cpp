#include "tests/support/devices/fake_falcon.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

class Talk {
 public:
  explicit Talk(FakeUsb& usb) : connection_(usb.open(usb.devices().at(0))) {
    connection_->claim(0);
    in_ = connection_->makeTransfer(0x81, 64);
    out_ = connection_->makeTransfer(0x02, 64);
  }
  void request(const FtdiRequest& request) {
    connection_->control({.request_type = 0x40, .request = request.request, .value = request.value}, {}, 1);
  }
  // Returns the payload of the next packet; empty if none comes within 0.1 s.
  std::vector<std::uint8_t> ask(const std::vector<std::uint8_t>& bytes) {
    std::copy(bytes.begin(), bytes.end(), out_->buffer().begin());
    EXPECT_EQ(connection_->run(*out_, bytes.size(), 0.1), UsbStatus::done);
    if (connection_->run(*in_, 64, 0.1) != UsbStatus::done) return {};
    return {in_->data().begin() + 2, in_->data().end()};
  }

 private:
  std::unique_ptr<UsbConnection> connection_;
  std::unique_ptr<UsbTransfer> in_, out_;
};

std::vector<std::uint8_t> bytesOf(const FalconCommand& command) {
  const FalconPacket packet = packFalconCommand(command);
  return {packet.begin(), packet.end()};
}

TEST(FakeFalcon, EchoesAnImageAndRunsItAtTheRunningSpeed) {
  FakeUsb usb;
  FakeFalcon fake(usb);
  fake.image_bytes = 3;
  Talk talk(usb);
  talk.request(ftdi::kBaud1500k);
  EXPECT_TRUE(talk.ask(bytesOf({})).empty());
  talk.request(ftdi::kBaud9600);
  EXPECT_EQ(talk.ask({0x0a, 0x43, 0x0d}), (std::vector<std::uint8_t>{0x0a, 0x44, 0x2c, 0x0d}));
  talk.request(ftdi::kBaud140k);
  EXPECT_EQ(talk.ask({0x41}), (std::vector<std::uint8_t>{0x41}));
  fake.wrong_echo = 1;
  EXPECT_EQ(talk.ask({7, 8, 9}), (std::vector<std::uint8_t>{7, 8 ^ 0x55, 9}));
  EXPECT_EQ(fake.image, (std::vector<std::uint8_t>{7, 8, 9}));
  EXPECT_FALSE(fake.running);
  talk.request(ftdi::kBaud1500k);
  EXPECT_TRUE(fake.running);
  EXPECT_EQ(talk.ask(bytesOf({})).size(), 16u);
}

TEST(FakeFalcon, CountsJumpWhenItIsHomedAndTheForceIsThatOfItsMotors) {
  FakeUsb usb;
  FakeFalcon fake(usb);
  fake.powerUp(true);
  EXPECT_THROW(fake.home(), std::logic_error);
  Talk talk(usb);
  talk.request(ftdi::kBaud1500k);
  const auto report = [&](const FalconCommand& command) {
    FalconReportParser parser;
    for (const std::uint8_t byte : talk.ask(bytesOf(command))) parser.push(byte);
    EXPECT_EQ(parser.reports(), 1u);
    return parser.report();
  };
  const auto counts = falconCountsOfAngles(falconAngles(kFalconCentre_F).value());
  FalconReport before = report({.homing = true});
  EXPECT_FALSE(before.allHomed());
  EXPECT_NE(before.counts, counts);
  report({.motors = {1, 0, 0}});
  EXPECT_EQ(fake.forces_before_homing(), 1u);
  fake.home();
  fake.buttons = 5;
  FalconCommand push;
  push.motors = falconMotors(falconTorques(kFalconCentre_F, Eigen::Vector3d(1, -2, 3)).value(), kFalconMotorPerNm);
  const FalconReport after = report(push);
  EXPECT_TRUE(after.allHomed());
  EXPECT_EQ(after.counts, counts);
  EXPECT_EQ(after.buttons, 5);
  EXPECT_LT((fake.force_N() - Eigen::Vector3d(1, -2, 3)).norm(), 0.02);
  EXPECT_EQ(fake.forces_before_homing(), 1u);
  EXPECT_TRUE(usb.violations().empty());
}

}  // namespace
}  // namespace filiform::test
