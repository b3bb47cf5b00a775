// Driver of the Novint Falcon over USB: three force components and four buttons on the grip.
//
//   Falcon falcon(systemUsb(), {.firmware = "falcon.bin"});
//   falcon.open();      // probes the device; loads the firmware if it runs none: 0.1 s, or 3 s
//   const DeviceState state = falcon.exchange(wrench);  // homing; ready after the grip was pulled out and pushed in
//
// Novint's firmware may not be redistributed. Owners have it on the driver or SDK that came with the device: a .bin
// file of 7 to 9 kB. Lamps: red while homing is needed, green when ready, off when closed. HARDWARE.md lists what only
// tests with a real device can show.
//
// Safety rules, tested against a simulated faulty device:
//   - no force before all three encoders are homed
//   - motor values are limited together, so that the force keeps its direction
//   - the force grows from zero during ramp_s after homing and after every gap
//   - a report counts only if it is well-formed and the grip can have reached its position
//   - after kStale_s without a report, the motors are sent zero; after kLost_s, the status is fault
//   - close() and a fault send zero several times
// An exchange ends within kAnswerTime_s, even if a fault occurs. Thread rule: as HapticDevice.
#pragma once

#include "device/device_gate.h"
#include "device/falcon/falcon_kinematics.h"
#include "device/falcon/falcon_protocol.h"
#include "device/haptic_device.h"
#include "device/usb/usb_transport.h"

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
  std::string firmware{};                   // file name; empty: from the environment variable kFalconFirmwareVariable
  std::string bus_path{};                   // USB socket or serial number, if there are several; empty: the only device
  double motor_per_Nm = kFalconMotorPerNm;  // motor value for 1 N m; HARDWARE.md explains the calibration
  double ramp_s = 0.5;
  bool event_character = false;  // let the bridge pass reports on at once; untested on hardware
};

// Reads what follows "falcon" in a device's name: "", ":FIRMWARE", ",SOCKET" or ":FIRMWARE,SOCKET". SOCKET, after the
// last comma, is a USB socket or a serial number.
FalconOptions falconOptions(const std::string& argument);

struct FalconCounters {  // since open()
  std::uint64_t reports = 0;
  std::uint64_t skipped_bytes = 0;    // bytes that belong to no report
  std::uint64_t unanswered = 0;       // exchanges without a report in time
  std::uint64_t refused_reports = 0;  // well-formed, but the grip cannot be there
  std::uint64_t transfer_errors = 0;
};

class Falcon : public HapticDevice {
 public:
  static constexpr double kAnswerTime_s = 0.005;  // longest duration of exchange()
  static constexpr double kStale_s = DeviceGate::kStale_s;
  static constexpr double kLost_s = 0.25;
  static constexpr double kVelocityWindow_s = 0.012;
  static constexpr int kZeroPackets = 5;
  static constexpr double kMostSpeed_m_s = 4;  // of the grip; reject a report that implies a faster grip
  static constexpr int kBelieved = 5;          // accept after this many consistent rejected reports

  // The transport must outlive this object.
  explicit Falcon(UsbTransport& transport, FalconOptions options = {});
  ~Falcon() override;

  // Finds the device, connects and loads the firmware if needed. If there is no device, only lists USB devices. Throws
  // DeviceError, with the reason and what to do, if: no device is plugged in, or several and none is named; permission
  // is missing (names the udev rule); no firmware is running or given (says where owners find it); the firmware file is
  // unusable; loading failed (names the step).
  void open() override;
  void close() noexcept override;
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  // Sends the force and waits at most kAnswerTime_s for the device's report. Without a report, returns the last state
  // with its time unchanged. If the device is lost, sends zeros within kAnswerTime_s; close() repeats them. If the
  // device takes none of these zeros, sent_N is the last force that it took. Ignores torques. Handles the transport's
  // events on the calling thread.
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
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  // the force of these motor values
  };
  Command commandFor(const Eigen::Vector3d& force_N) const noexcept;
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
  std::unique_ptr<UsbTransfer> in_, out_;  // must not outlive usb_
  FalconReportParser parser_;
  FalconCounters counters_;
  DeviceState state_;
  DeviceGate gate_;
  double opened_s_ = 0, report_s_ = 0;                 // transport's clock; report_s_: last accepted report
  double deadline_s_ = 0;                              // of the current exchange, transport's clock
  Eigen::Vector3d sent_N_ = Eigen::Vector3d::Zero();   // last force sent to the device
  Eigen::Vector3d taken_N_ = Eigen::Vector3d::Zero();  // last force that the device is known to have taken
  Eigen::Vector3d p_F_ = kFalconCentre_F;
  Eigen::Vector3d refused_F_ = kFalconCentre_F;  // position of the last rejected report
  int refused_in_a_row_ = 0;
  int unanswered_ = 0;                // commands without a report yet, 2 at most
  double asked_s_ = 0;                // when the first of these was sent, or when the last report came
  std::array<Sample, 64> samples_{};  // a ring buffer, for the velocity
  std::size_t newest_ = 0, held_ = 0;
};

}  // namespace filiform
