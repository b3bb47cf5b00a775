// Trees over the boxes of segments, as peers of the benchmarks: CGAL's with its own distance query, and Boost's packed
// R-tree. Functions without state.
#pragma once

#include "tools/lab/bench/peers.h"

namespace filiform::tools {

Peer cgalPeer();
Peer boostPeer();

}  // namespace filiform::tools
