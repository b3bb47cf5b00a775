// Embree 3 as a peer of the benchmarks: point queries over segments, which it has only as geometry of the user's own.
// Empty unless it was built in (FILIFORM_BENCH_EMBREE).
#pragma once

#include "index/grid.h"

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

using SegmentEnds = std::array<Vector3d, 2>;

struct EmbreePeer {
  std::string version;
  std::function<double(const Vector3d& h_W)> squared;  // um^2, to the nearest segment; empty: not built in
};

// Builds its tree. The segments must outlive the peer. Coordinates below 1e4 um, since Embree searches in float.
EmbreePeer embreePeer(const std::vector<SegmentEnds>& segments);

}  // namespace filiform::tools
