// Sets a device up with the person who holds it: behind `filiform devices --setup`. Thread rule: functions without
// state.
#pragma once

#include "device/check/device_check.h"
#include "device/haptic_device.h"
#include "solver/workspace/button_map.h"

#include <functional>
#include <string>

namespace filiform::tools {

// Asks the person to push the handle of an open and ready device to the right, up and closer, and looks where it goes;
// no force acts. Returns what is wrong, in one line; empty if all is right, or if the handle rests for `patience_s`. A
// simulated hand that is led pushes by itself. Throws DeviceError if the device is lost.
std::string checkDirections(HapticDevice& device, const DeviceCheckOptions& options, double patience_s);

struct DeviceSetupOptions {
  DeviceCheckOptions check{};  // homing_s, tell and poll count
  double patience_s = 20;      // for a push, for a button
  // Asks the person and returns the answer; empty: the proposal is right.
  std::function<std::string(const std::string&)> ask{};
};

// Opens the device, checks its directions, asks for the action of each button that the person presses, and closes it.
// Buttons that nobody presses do nothing. Throws DeviceError if the device is not ready in time, or if a direction is
// wrong; what poll() and ask() throw.
ButtonMap setUpDevice(HapticDevice& device, const DeviceSetupOptions& options);

}  // namespace filiform::tools
