// Connections to bridges. Functions without state; any thread.
#pragma once

#include "device/bridge/bridge_protocol.h"
#include "device/internal/owned_descriptor.h"

#include <array>
#include <string>

namespace filiform::internal {

// These throw DeviceError, with the remedy. The sockets do not block.
OwnedDescriptor connectToPath(const std::string& path);     // refuses a bridge of another user
OwnedDescriptor connectToPort(const std::string& address);  // udp:HOST:PORT of this machine
// Reads the cookie from this file; empty: FILIFORM_BRIDGE_COOKIE, or "cookie" in bridgeFolder().
std::array<unsigned char, FB_COOKIE_BYTES> readCookie(std::string path);
// The path of the bridge that listens in bridgeFolder(), if there is one alone.
std::string onlyBridge();

}  // namespace filiform::internal
