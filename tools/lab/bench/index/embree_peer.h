// Embree 3 as a peer of the benchmarks: point queries over segments, which are user geometry in Embree.
// Function without state.
#pragma once

#include "tools/lab/bench/peers.h"

namespace filiform::tools {

Peer embreePeer();

}  // namespace filiform::tools
