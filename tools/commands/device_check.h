// What is plugged in that filiform can use, and whether it works: behind `filiform devices`.
// Thread rule: functions without state.
#pragma once

#include "device/haptic_device.h"
#include "device/usb/usb_transport.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

struct FoundDevice {
  std::string kind;    // "Novint Falcon", "3Dconnexion mouse"
  std::string device;  // what --device takes for it
  UsbDeviceInfo info;
  std::string state;   // "ready", "no_permission", "no_firmware"
  std::string remedy;  // empty if ready
};

// Of what this build has a driver for, in the order of bus paths. Opens nothing. Throws as UsbTransport::devices().
std::vector<FoundDevice> findDevices(UsbTransport& transport);

// Whether --device `device` names one of them that may be opened. Throws as findDevices().
bool isPluggedIn(UsbTransport& transport, const std::string& device);

struct DeviceCheckOptions {
  double read_s = 1;
  double homing_s = 60;         // how long the person has for it
  double force_N = 0.5;         // at most, along each axis in turn; not where the device renders none
  double ramp_s = 1;            // up and down again
  double most_moved_m = 0.025;  // a hand that gives way further than that ends the force
  std::function<void(const std::string&)> tell{};  // what the person should do now
};

struct DeviceCheck {
  double homing_s = 0;  // 0: it needed none
  std::uint64_t exchanges = 0;
  double seconds = 0, rate_Hz = 0;                    // of the reading
  double longest_gap_s = 0;                           // between exchanges
  std::uint64_t reports = 0;                          // of the device; exchanges where it does not say
  std::uint32_t buttons = 0;                          // that were held at any time
  double force_N = 0;                                 // that was reached; 0: it renders none
  Eigen::Vector3d moved_m = Eigen::Vector3d::Zero();  // how far the hand gave way to it along x, y, z
  bool stopped = false;                               // the force was ended because the hand moved too far
  std::vector<std::string> refusals;                  // see HapticLoop
};

// Opens the device, waits for its homing, reads it, ramps a small force along each axis, and closes it; zero force on
// every way out. Throws DeviceError if it cannot be opened, is lost, or is not homed in time; Interrupted.
DeviceCheck checkDevice(HapticDevice& device, const DeviceCheckOptions& options = {});

}  // namespace filiform::tools
