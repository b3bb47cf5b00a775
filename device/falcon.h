// The Novint Falcon over USB: three degrees of freedom of force, four buttons on the grip.
//
//   Falcon falcon(systemUsb(), {.firmware = "falcon.bin"});
//   falcon.open();      // probes, loads the firmware if there is none: 0.1 s, or 3 s
//   const DeviceState state = falcon.exchange(wrench);  // homing; ready once the grip was pulled out and pushed in
//
// The firmware is Novint's and not for others to give away: the device's owner has it with the driver or the SDK that
// came with the device, as a .bin file of 7 to 9 kB. Lamps: red while it waits for homing, green when ready, none when
// closed. What nobody without the device can know is in HARDWARE.md, with how to find it out.
//
// Safety, all of it tested against a fake that misbehaves: no force before all three encoders are homed; the motors'
// values are limited together; the force grows from zero over ramp_s after homing and after any gap; a state is only
// taken from a well-formed report whose place the hand can have got to; without one for kStale_s the motors are sent
// zero whatever is commanded, and without one for kLost_s the device is in fault; close and fault send zero several
// times. An exchange ends within kAnswerTime_s, also where a fault comes in it. Thread rule: as HapticDevice.
#pragma once

#include "device/falcon_kinematics.h"
#include "device/falcon_protocol.h"
#include "device/haptic_device.h"
#include "device/usb_transport.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

inline constexpr std::uint16_t kFalconVendor = 0x0403, kFalconProduct = 0xcb48;
inline constexpr const char* kFalconFirmwareVariable = "FILIFORM_FALCON_FIRMWARE";

struct FalconOptions {
  std::string firmware{};                   // file; empty: what the environment variable kFalconFirmwareVariable names
  std::string bus_path{};                   // which of several; empty: the first
  double motor_per_Nm = kFalconMotorPerNm;  // calibration of the force, see HARDWARE.md
  double ramp_s = 0.5;
  bool event_character = false;  // ask the bridge to hand reports on at once; untested on hardware
};

struct FalconCounters {  // since open()
  std::uint64_t reports = 0;
  std::uint64_t skipped_bytes = 0;    // that belonged to no report
  std::uint64_t unanswered = 0;       // exchanges without a report in time
  std::uint64_t refused_reports = 0;  // well-formed, of a place where the grip cannot be
  std::uint64_t transfer_errors = 0;
};

class Falcon : public HapticDevice {
 public:
  static constexpr double kAnswerTime_s = 0.005;  // exchange() waits no longer, whatever fails
  static constexpr double kStale_s = 0.010;
  static constexpr double kLost_s = 0.25;
  static constexpr double kVelocityWindow_s = 0.012;
  static constexpr int kZeroPackets = 5;
  static constexpr double kMostSpeed_m_s = 4;  // of the grip; a report beyond it is not believed, until
  static constexpr int kBelieved = 5;          // in a row agree

  // The transport must outlive it.
  explicit Falcon(UsbTransport& transport, FalconOptions options = {});
  ~Falcon() override;

  // Without the device, nothing is read but the list of devices. Throws DeviceError: not plugged in, no permission (the
  // text names the udev rule), no firmware in the device and none given (the text says where owners have it), a file
  // that is none, loading failed (the text says at what).
  void open() override;
  void close() noexcept override;
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  // Sends the force and waits for the report that answers, kAnswerTime_s at most. Without one the state is the last
  // one, its time unchanged. Sends zeros if the device is lost; these also end at kAnswerTime_s, and close() repeats
  // them. If the device takes none of these zeros, sent_N is the last force that it took. Torques are ignored. Handles
  // the transport's events on the calling thread.
  DeviceState exchange(const Wrench& wrench) noexcept override;

  const FalconCounters& counters() const noexcept { return counters_; }

 private:
  struct Sample {
    double time_s;
    Eigen::Vector3d p_D;
  };
  UsbDeviceInfo find() const;
  void connect(const UsbDeviceInfo& info);
  void disconnect() noexcept;
  void prepareToRun();
  bool answersAsRunning(double patience_s) noexcept;
  std::vector<std::uint8_t> readFirmware() const;
  void load(std::span<const std::uint8_t> image);

  struct Command {
    FalconCommand packet;
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  // that the motors are told
  };
  Command commandFor(const Wrench& wrench) const noexcept;
  bool send(const FalconCommand& command, bool at_once) noexcept;
  bool takeReports() noexcept;
  void take(const FalconReport& report) noexcept;
  void begin(const Eigen::Vector3d& p_F) noexcept;
  void moveTo(const Eigen::Vector3d& p_F) noexcept;
  void sendZeros(const FalconCommand& zero, double until_s) noexcept;
  void fail() noexcept;

  UsbTransport& transport_;
  FalconOptions options_;
  DeviceCapabilities capabilities_;
  std::unique_ptr<UsbConnection> usb_;
  std::unique_ptr<UsbTransfer> in_, out_;  // within the life of usb_
  FalconReportParser parser_;
  FalconCounters counters_;
  DeviceState state_;
  double opened_s_ = 0, report_s_ = 0, ramp_from_s_ = 0;  // transport's clock; of the last report that was believed
  double deadline_s_ = 0;                                 // of the exchange under way, transport's clock
  Eigen::Vector3d sent_N_ = Eigen::Vector3d::Zero();      // of the last command sent
  Eigen::Vector3d taken_N_ = Eigen::Vector3d::Zero();     // of the last command that the device is known to have taken
  Eigen::Vector3d p_F_ = kFalconCentre_F;
  Eigen::Vector3d refused_F_ = kFalconCentre_F;  // where the last report that was not believed was
  int refused_in_a_row_ = 0;
  int unanswered_ = 0;                // commands on their way, 2 at most
  double asked_s_ = 0;                // when the first of them was sent, or the last answer came
  std::array<Sample, 64> samples_{};  // a ring, for the velocity
  std::size_t newest_ = 0, held_ = 0;
};

}  // namespace filiform
