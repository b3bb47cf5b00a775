// What the window says of the network. Pure; any thread.
#pragma once

#include "index/file/remote_counters.h"

#include <string>

namespace filiform::internal {

// One line if the network is lost or slow; else empty.
std::string networkText(const RemoteCounters& network);

}  // namespace filiform::internal
