// The folder where bridges listen. Functions without state; any thread.
#pragma once

#include "device/haptic_device.h"

#include <string>
#include <vector>

namespace filiform {

// Where bridges listen by default: XDG_RUNTIME_DIR/filiform, or /tmp/filiform-UID. It need not exist.
std::string bridgeFolder();
// FILIFORM_BRIDGE_COOKIE, or "cookie" in bridgeFolder().
std::string bridgeCookieFile();

struct FoundBridge {
  std::string path;      // of its socket
  bool listens = false;  // false: the socket stayed behind when its bridge was killed
};
// The sockets NAME.bridge of this user in bridgeFolder(), by name. Connects to each for a moment.
std::vector<FoundBridge> findBridges();
// The path of the only bridge that listens there. Throws DeviceError for none, and lists several.
std::string onlyBridge();

}  // namespace filiform
