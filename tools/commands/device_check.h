// Finds the devices that are plugged in, and tests one: behind `filiform devices`. Thread rule: functions without
// state.
#pragma once

#include "device/haply/haply_service.h"
#include "device/haptic_device.h"
#include "device/usb/usb_transport.h"
#include "tools/commands/device_walk.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

struct FoundDevice {
  std::string kind;    // "Novint Falcon", "3Dconnexion mouse", "gamepad", "bridge"
  std::string device;  // the name for --device
  UsbDeviceInfo info;  // of a USB device; of a Haply device or gamepad the name alone, of a bridge empty
  // "ready", "no_permission", "no_firmware"; of a Haply device as in HaplyServiceState; of a bridge also "not_running"
  std::string state;
  std::string remedy;  // empty if ready
};

// The plugged-in devices that this build has a driver for, by bus path. Opens none. Throws as UsbTransport::devices().
std::vector<FoundDevice> findDevices(UsbTransport& transport);

// The gamepads of the system. Opens none.
std::vector<FoundDevice> findPads();

// The bridges in bridgeFolder(), by name. Connects to each for a moment.
std::vector<FoundDevice> findBridgedDevices();

// The devices of a Haply service as `found` devices; `info` has only the name.
std::vector<FoundDevice> devicesOf(const HaplyServiceState& service);

// Returns whether `device`, a name for --device, is plugged in and may be opened. Asks the Haply service for a
// name that begins with haply. Throws as findDevices().
bool isPluggedIn(UsbTransport& transport, const std::string& device);

struct DeviceCheckOptions {
  double read_s = 1;
  double homing_s = 60;                     // time limit for homing
  double force_N = 0.5;                     // peak, along each axis in turn; not used if the device renders no force
  double ramp_s = 1;                        // duration of the ramp, up and down
  double most_moved_m = 0.025;              // the force ends if the hand moves farther
  std::optional<DeviceWalkOptions> walk{};  // also walks through DeviceWalk
  std::function<void(const std::string&)> tell{};  // receives instructions for the user
};

struct DeviceCheck {
  double homing_s = 0;  // 0: no homing needed
  std::uint64_t exchanges = 0;
  double seconds = 0, rate_Hz = 0;                    // duration and rate of the reading
  double longest_gap_s = 0;                           // between two exchanges
  std::uint64_t reports = 0;                          // of the device; the number of exchanges if it does not count
  std::uint32_t buttons = 0;                          // all buttons that were pressed at any time
  double force_N = 0;                                 // largest force rendered; 0: the device renders none
  Eigen::Vector3d moved_m = Eigen::Vector3d::Zero();  // motion of the hand under the force, along x, y, z
  bool stopped = false;                               // the force ended because the hand moved too far
  std::vector<std::string> refusals;                  // see HapticLoop
  std::optional<DeviceWalkFound> walk;                // with DeviceCheckOptions::walk
};

// Opens the device, waits for its homing, reads it, ramps a small force along each axis, and closes it. Every exit
// sends zero force. Throws DeviceError if the device cannot be opened, is lost, or is not homed in time; Interrupted.
DeviceCheck checkDevice(HapticDevice& device, const DeviceCheckOptions& options = {});

}  // namespace filiform::tools
