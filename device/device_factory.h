// Devices by name, as the command line gives them. Thread rule: functions only, no state.
#pragma once

#include "device/haptic_device.h"

#include <memory>
#include <string>

namespace filiform {

class UsbTransport;

struct DeviceFactoryOptions {
  double period_s = 0.001;      // of devices in virtual time
  int delay_samples = 1;        // of the simulated hand
  UsbTransport* usb = nullptr;  // for hardware; must outlive the device. None: the machine's own
};

// "sim:loose", "sim:medium", "sim:firm" ("sim" is medium), "replay:FILE", "null"; over USB "falcon" or
// "falcon:FIRMWARE", "spacemouse" (the first) or "spacemouse:1-2" (the one in that socket). Not opened, except that a
// recording is read and checked. Throws UnknownDevice naming what this build has. A simulated hand is a SimulatedHand:
// its owner aims it through that.
std::unique_ptr<HapticDevice> makeDevice(const std::string& spec, const DeviceFactoryOptions& options = {});

// What makeDevice takes, for help texts: "sim:loose|medium|firm, replay:FILE, null, ...".
const char* deviceChoices();

}  // namespace filiform
