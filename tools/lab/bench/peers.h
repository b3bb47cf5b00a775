// Other structures that find the nearest segment, to be raced in the same process (nearest_bench.cpp). Each has the
// settings that were searched (peers_bench.cpp); the best one is raced. Functions without state.
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
  // The answers read the segments that were given: they belong to what the setting needs in memory.
  bool keeps_segments = false;
  // Builds its tree, which lives as long as the returned function. The segments must outlive it; they are within 1e4 um
  // of the origin, since some settings search in float.
  std::function<SquaredDistance(const std::vector<SegmentEnds>& segments)> build;
};

struct Peer {
  std::string name, version;
  std::vector<PeerSetting> settings;  // empty: not in this build; version is empty then
  std::size_t raced = 0;              // the best of the settings

  bool inBuild() const { return !settings.empty(); }
  const PeerSetting& best() const { return settings.at(raced); }
};

// All that are known, those that are not in this build too (FILIFORM_BENCH_PEERS, `tools/setup --bench`).
std::vector<Peer> peers();

// `raced` of a peer whose best setting has this name. Throws std::logic_error if no setting has.
Peer racedWith(Peer peer, const std::string& setting);

}  // namespace filiform::tools
