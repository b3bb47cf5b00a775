// Asks the Haply Inverse Service what is connected, for `filiform devices`. Commands no force. Thread rule: functions
// without state.
#pragma once

#include "device/haply/haply_device.h"

#include <string>
#include <vector>

namespace filiform {

struct HaplyServiceState {
  struct Device {
    std::string id, state;  // "ready", "no_power", "not_calibrated", "not_ready"
    std::string remedy;     // what the person must do; empty if ready
    bool in_use = false;    // by another program
  };
  std::string address;  // HOST:PORT
  bool runs = false;
  std::string trouble;  // why it does not run, or why it cannot be asked
  std::string version;  // as it answers to GET /version
  std::vector<Device> devices;
  std::vector<std::string> grips;  // ids
};

// Waits at most timeout_s (s) for each of two answers. Does not throw DeviceError: `trouble` says what is wrong.
HaplyServiceState askHaplyService(const HaplyOptions& options, double timeout_s = 0.5);

}  // namespace filiform
