// Other structures that find the nearest segment, raced in the same process (nearest_bench.cpp). peers_bench.cpp
// searches their settings; the best setting is raced. Functions without state.
#pragma once

#include "index/geometry/grid.h"

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

using SegmentEnds = std::array<Vector3d, 2>;
using SquaredDistance = std::function<double(const Vector3d& h_W)>;  // um^2, to the nearest segment

struct PeerSetting {
  std::string name;
  // A query reads the segments that were given, so they count as memory of this setting.
  bool keeps_segments = false;
  // Builds the tree, which lives as long as the returned function. The segments must outlive it. They must lie within
  // 1e4 um of the origin, because some settings search in float.
  std::function<SquaredDistance(const std::vector<SegmentEnds>& segments)> build;
};

struct Peer {
  std::string name, version;
  std::vector<PeerSetting> settings;  // empty if the peer is not in this build; version is then empty too
  std::size_t raced = 0;              // position of the best setting

  bool inBuild() const { return !settings.empty(); }
  const PeerSetting& best() const { return settings.at(raced); }
};

// All known peers, including those that are not in this build (FILIFORM_BENCH_PEERS, `tools/setup --bench`).
std::vector<Peer> peers();

// Returns the peer with `raced` set to the setting of this name. Throws std::logic_error if there is no such setting.
Peer racedWith(Peer peer, const std::string& setting);

}  // namespace filiform::tools
