// A Falcon on a fake USB: boot loader, firmware, motors, encoders, and a hand that holds the grip at a given place. It
// keeps what it receives, so that a test reads the last force from the device and not from the driver.
//
//   FakeUsb usb;
//   FakeFalcon fake(usb);
//   Falcon falcon(usb, {.firmware = image_file});
//   falcon.open();
//   fake.home();
//
// Packets are counted as in FakeUsbDevice: one for each report, echo or greeting. Thread rule: one thread.
#pragma once

#include "device/falcon/falcon_kinematics.h"
#include "device/falcon/falcon_protocol.h"
#include "tests/support/devices/fake_usb.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform::test {

class FakeFalcon {
 public:
  struct Received {
    double time_s = 0;
    std::array<std::int16_t, 3> motors{};
    bool homing = false, green = false, blue = false, red = false;
    bool homed = false;  // state of the device at that moment
    bool isZero() const { return motors == std::array<std::int16_t, 3>{}; }
  };

  explicit FakeFalcon(FakeUsb& usb, const std::string& bus_path = "1-1");
  FakeFalcon(const FakeFalcon&) = delete;
  FakeFalcon& operator=(const FakeFalcon&) = delete;

  FakeUsbDevice& usb_device() { return device_; }

  // Firmware loaded since the last power-up. It runs when the host changes to the running speed.
  bool running = false;
  std::vector<std::uint8_t> image;
  std::size_t image_bytes = 7914;         // the device does not run with fewer
  std::optional<std::size_t> wrong_echo;  // byte of the image that is echoed wrong, bad_attempts times
  int bad_attempts = 1;
  bool mute = false;                 // the firmware runs but does not reply
  void powerUp(bool with_firmware);  // resets the counts; the device is not homed

  // The grip.
  Eigen::Vector3d p_D = Eigen::Vector3d::Zero();
  std::uint8_t buttons = 0;
  double report_delay_s = 1e-3;
  bool sends_status = false;  // send packets without payload whenever a read finds nothing
  // The grip passes the index marks: the counts jump from values since power-up to true values. Requires that the
  // homing bit was received.
  void home();
  bool homed() const { return homed_; }
  std::optional<std::array<std::int16_t, 3>> counts;  // reported instead of the counts of p_D

  const std::vector<Received>& received() const { return received_; }
  const Received& last() const { return received_.back(); }  // requires that something was received
  // The force at the grip (N) of the last motor values, with this calibration.
  Eigen::Vector3d force_N(double motor_per_Nm = kFalconMotorPerNm) const;
  // Number of motor values that were not zero while the device was not homed: must be 0.
  std::size_t forces_before_homing() const;

 private:
  void onControl(const UsbSetup& setup);
  void onWrite(std::span<const std::uint8_t> bytes);
  void run(std::span<const std::uint8_t> bytes);
  void report();
  void answer(std::span<const std::uint8_t> payload, double delay_s);

  FakeUsbDevice& device_;
  std::uint16_t baud_ = 0;
  bool loading_ = false, homed_ = false, homing_seen_ = false;
  int attempts_ = 0;
  std::vector<std::uint8_t> stream_;
  std::vector<Received> received_;
};

}  // namespace filiform::test
