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
  bool direct = false;          // as ",direct" after the name
  UsbTransport* usb = nullptr;  // for hardware; must outlive the device. nullptr: systemUsb()
};

// Makes a device; open() is left to the caller. Falcon and Haply are opened by a process of their own, which starts
// here (process/process_device.h), unless ",direct" follows the name or options.usb is set. Names:
//   sim:loose, sim:medium, sim:firm   a SimulatedHand, which its owner steers; "sim" means medium
//   replay:FILE                       a recording; the file is read and checked here
//   null                              a NullDevice
//   falcon, falcon:FIRMWARE,SOCKET    a Novint Falcon over USB; of several, the one in USB socket SOCKET
//   spacemouse, spacemouse:1-2        the first 3Dconnexion mouse, or the one in USB socket 1-2
//   haply, haply:HOST:PORT, haply,ID  a Haply Inverse3, through the Haply Inverse Service here or there
//   bridge:PATH, bridge:udp:HOST:PORT the device behind a bridge; "bridge" alone: the only bridge. Connects here
// Throws UnknownDevice for another name, DeviceError for a recording that cannot be read, a bridge that does not answer
// or a device that its process cannot open.
std::unique_ptr<HapticDevice> makeDevice(const std::string& spec, const DeviceFactoryOptions& options = {});

// True for the name of a Falcon or an Inverse3: it renders force, and keeps its own time.
bool isForceDevice(const std::string& spec);
// The name without ",direct" at its end.
std::string withoutDirect(const std::string& spec);
// The file in "falcon:FIRMWARE,SOCKET" or "replay:FILE"; empty for other names.
std::string fileOfDevice(const std::string& spec);

// The names that makeDevice() accepts, for help texts: "sim:loose|medium|firm, replay:FILE, null, ...".
const char* deviceChoices();

}  // namespace filiform
