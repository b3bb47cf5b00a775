// FLANN and nanoflann as peers of the benchmarks. They search points, so segments are cut into pieces no longer than
// 4 um, the trees hold the pieces' middles, and each middle that they meet is refined to the distance of its segment:
// exact, in one pass.
#pragma once

#include "tools/bench/embree_peer.h"

namespace filiform::tools {

struct PointPeer {
  std::string name, version;
  std::function<double(const Vector3d& h_W)> squared;  // um^2, to the nearest segment
};

// Builds their trees: FLANN's, and nanoflann's where it was there when this was built. The segments must outlive the
// peers.
std::vector<PointPeer> midpointPeers(const std::vector<SegmentEnds>& segments);

}  // namespace filiform::tools
