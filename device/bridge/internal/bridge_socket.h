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
std::array<unsigned char, FB_COOKIE_BYTES> readCookie(const std::string& path);

}  // namespace filiform::internal
