// Makes devices from the names given on the command line. Thread rule: functions without state.
#pragma once

#include "device/haptic_device.h"

#include <memory>
#include <string>

namespace filiform {

class UsbTransport;

// Options of makeDevice().
struct DeviceFactoryOptions {
  double period_s = 0.001;      // of devices in virtual time
  int delay_samples = 1;        // of the simulated hand
  UsbTransport* usb = nullptr;  // for hardware; must outlive the device. nullptr: systemUsb()
};

// Makes a device; open() is left to the caller. Names:
//   sim:loose, sim:medium, sim:firm   a SimulatedHand, which its owner steers; "sim" means medium
//   replay:FILE                       a recording; the file is read and checked here
//   null                              a NullDevice
//   falcon, falcon:FIRMWARE,SOCKET    a Novint Falcon over USB; of several, the one in USB socket SOCKET
//   spacemouse, spacemouse:1-2        the first 3Dconnexion mouse, or the one in USB socket 1-2
//   haply, haply:HOST:PORT, haply,ID  a Haply Inverse3, through the Haply Inverse Service here or there
//   bridge:PATH, bridge:udp:HOST:PORT the device behind a bridge; "bridge" alone: the only bridge. Connects here
// Throws UnknownDevice for another name, DeviceError for a recording that cannot be read or a bridge that does not
// answer.
std::unique_ptr<HapticDevice> makeDevice(const std::string& spec, const DeviceFactoryOptions& options = {});

// The names that makeDevice() accepts, for help texts: "sim:loose|medium|firm, replay:FILE, null, ...".
const char* deviceChoices();

}  // namespace filiform
