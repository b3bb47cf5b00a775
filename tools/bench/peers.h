// Other structures that find the nearest segment, to be raced in the same process (nearest_bench.cpp). Functions
// without state.
#pragma once

#include "index/grid.h"

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

using SegmentEnds = std::array<Vector3d, 2>;
using SquaredDistance = std::function<double(const Vector3d& h_W)>;  // um^2, to the nearest segment

struct Peer {
  std::string name;
  std::string version;  // empty: not in this build, and there is no `build`
  // Builds its tree, which lives as long as the answer. The segments must outlive it; they are within 1e4 um of the
  // origin, since Embree searches in float.
  std::function<SquaredDistance(const std::vector<SegmentEnds>& segments)> build;
};

// All that are known, those that are not in this build too (FILIFORM_BENCH_PEERS, `tools/setup --bench`).
std::vector<Peer> peers();

}  // namespace filiform::tools
