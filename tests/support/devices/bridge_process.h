// A bridge of tools/bridges as a process.
#pragma once

#include "device/bridge/bridge_device.h"
#include "tests/support/servers/started_process.h"

#include <string>

namespace filiform::test {

class BridgeProcess : public StartedProcess {
 public:
  // Starts `NAME ADDRESS`, without an address if it is empty, and waits until it listens. Throws std::runtime_error if
  // it does not. `log`: file for the rendered forces; empty: none.
  explicit BridgeProcess(const std::string& address, const std::string& log = "",
                         const std::string& name = "simulated");
};

// The path of a bridge's program, as built beside the tests.
std::string bridgeProgram(const std::string& name = "simulated");

// Why a BridgeDevice cannot be made; empty if it can.
std::string refusalOf(const BridgeOptions& options);

}  // namespace filiform::test
