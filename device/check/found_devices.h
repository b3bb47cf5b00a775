// Finds the devices that are plugged in: behind `filiform devices`. Thread rule: functions without state.
#pragma once

#include "device/haply/haply_service.h"
#include "device/usb/usb_transport.h"

#include <string>
#include <vector>

namespace filiform::tools {

struct FoundDevice {
  std::string kind;    // "Novint Falcon", "3Dconnexion mouse", "gamepad", "bridge"
  std::string device;  // the name for --device
  UsbDeviceInfo info;  // of a USB device; of a Haply device or gamepad the name alone, of a bridge empty
  // "ready", "no_permission", "no_firmware"; of a Haply device as in HaplyServiceState; of a bridge also "not_running"
  std::string state;
  std::string remedy;      // empty if ready
  std::string settings{};  // of a Haply device: as its service states them; empty: none
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

}  // namespace filiform::tools
