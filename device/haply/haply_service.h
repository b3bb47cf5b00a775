// Asks the Haply Inverse Service what is connected, for `filiform devices`. Commands no force. Thread rule: functions
// without state.
#pragma once

#include "device/haply/haply_device.h"

#include <string>
#include <utility>
#include <vector>

namespace filiform {

struct HaplyServiceState {
  struct Device {
    std::string id, state;  // "ready", "no_power", "not_calibrated", "not_ready"
    std::string remedy;     // what the person must do; empty if ready
    bool in_use = false;    // by another program
    // Name and value of what the service states about it: handedness, preset, mount, damping, gravity_compensation.
    std::vector<std::pair<std::string, std::string>> settings{};
  };
  std::string address;  // HOST:PORT
  bool runs = false;
  std::string trouble;  // why it does not run, or why it cannot be asked
  std::string version;  // as it answers to GET /version
  std::vector<Device> devices;
  std::vector<std::string> grips;  // ids
};

// Waits at most timeout_s (s) for each of two answers, and with `with_settings` for five of each device. Only services
// from version 3.5 on state settings. Does not throw DeviceError: `trouble` says what is wrong.
HaplyServiceState askHaplyService(const HaplyOptions& options, double timeout_s = 0.5, bool with_settings = false);

}  // namespace filiform
