// Tests a device on its haptic loop: behind `filiform devices --test`. Thread rule: a function without state.
#pragma once

#include "device/check/device_check.h"
#include "device/haptic_device.h"

namespace filiform::tools {

// Opens the device, waits for its homing, reads it, ramps a small force along each axis, and closes it. Every exit
// sends zero force. Throws DeviceError if the device cannot be opened, is lost, or is not homed in time;
// what options.poll() throws.
DeviceCheck checkDevice(HapticDevice& device, const DeviceCheckOptions& options = {});

}  // namespace filiform::tools
