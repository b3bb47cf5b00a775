// What the test of a device does and finds (device_test.h). Thread rule: values.
#pragma once

#include "device/check/device_walk.h"
#include "device/haptic_device.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

struct DeviceCheckOptions {
  double read_s = 1;
  double homing_s = 60;                     // time limit for homing
  double force_N = 0.5;                     // peak, along each axis in turn; not used if the device renders no force
  double ramp_s = 1;                        // duration of the ramp, up and down
  double most_moved_m = 0.025;              // the force ends if the hand moves farther
  bool directions = false;                  // also asks the person to push the handle: device_setup.h
  std::optional<DeviceWalkOptions> walk{};  // also walks through DeviceWalk
  std::function<void(const std::string&)> tell{};  // receives instructions for the user
  std::function<void()> poll{};                    // called every few milliseconds; an exception from it ends the test
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
  std::string wrong_direction{};                      // with DeviceCheckOptions::directions; empty: none
  std::vector<std::string> refusals;                  // see HapticLoop
  std::optional<DeviceWalkFound> walk;                // with DeviceCheckOptions::walk
};

}  // namespace filiform::tools
