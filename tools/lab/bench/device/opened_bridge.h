// The device behind a bridge that has just been started.
#pragma once

#include "device/bridge/bridge_device.h"

#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>

namespace filiform::tools {

// Connects and opens, again every 5 ms until the bridge listens. Throws std::runtime_error after 10 s.
inline std::unique_ptr<BridgeDevice> openedBridge(const BridgeOptions& options) {
  for (int i = 0; i < 2000; ++i) {
    try {
      auto device = std::make_unique<BridgeDevice>(options);
      device->open();
      return device;
    } catch (const DeviceError&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  throw std::runtime_error("bench: the bridge does not answer");
}

}  // namespace filiform::tools
