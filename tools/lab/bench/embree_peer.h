// Embree 3 as a peer of the benchmarks: point queries over segments, which it has only as geometry of the user's own.
// Function without state.
#pragma once

#include "tools/lab/bench/peers.h"

namespace filiform::tools {

Peer embreePeer();

}  // namespace filiform::tools
