// What the window says of the network. Pure; any thread.
#pragma once

#include "index/http/remote_options.h"

#include <string>

namespace filiform::internal {

// One line if the network is lost or slow; else empty.
std::string networkText(const RemoteCounters& network);

}  // namespace filiform::internal
