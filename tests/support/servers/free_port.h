// Ports for the servers that tests start.
#pragma once

#include <cstdint>
#include <sys/socket.h>

namespace filiform::test {

// A port of 127.0.0.1 that no socket of this type uses: another program may take it first. Throws std::runtime_error if
// there is none.
std::uint16_t freePort(int type = SOCK_STREAM);

}  // namespace filiform::test
