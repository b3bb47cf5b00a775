// The folder where bridges listen. Functions without state; any thread.
#pragma once

#include <string>
#include <vector>

namespace filiform {

// Where bridges listen by default: XDG_RUNTIME_DIR/filiform, or /tmp/filiform-UID. It need not exist.
std::string bridgeFolder();

struct FoundBridge {
  std::string path;      // of its socket
  bool listens = false;  // false: the socket stayed behind when its bridge was killed
};
// The sockets NAME.bridge of this user in bridgeFolder(), by name. Connects to each for a moment.
std::vector<FoundBridge> findBridges();

}  // namespace filiform
