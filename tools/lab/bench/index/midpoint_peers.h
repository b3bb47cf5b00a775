// FLANN and nanoflann as peers of the benchmarks. They search points. Segments are therefore cut into pieces of at most
// 4 um, the trees hold the middles of the pieces, and the distance to the segment is computed for each middle found.
// The result is exact, in one pass. Functions without state.
#pragma once

#include "tools/lab/bench/peers.h"

namespace filiform::tools {

Peer flannPeer();
Peer nanoflannPeer();

}  // namespace filiform::tools
