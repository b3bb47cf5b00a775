// FLANN and nanoflann as peers of the benchmarks. They search points, so segments are cut into pieces no longer than
// 4 um, the trees hold the pieces' middles, and each middle that they meet is refined to the distance of its segment:
// exact, in one pass. Functions without state.
#pragma once

#include "tools/lab/bench/peers.h"

namespace filiform::tools {

Peer flannPeer();
Peer nanoflannPeer();

}  // namespace filiform::tools
