// The pictures of one navigation run: the force that the hand felt, and the tissue with the way that the proxy went.
// Thread rule: thread-compatible.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/run.h"

#include <string>
#include <vector>

namespace filiform::tools {

class TravelReport {
 public:
  // Keeps what the pictures need of a tick: 48 bytes.
  void add(const TickRow& row);

  // Force against time, the moments of frontiers marked. Throws IoError. O(ticks).
  void writeForcePlot(const std::string& path, const std::string& title, const RunSummary& summary) const;
  // Every segment of the store seen from the front, tile by tile, and the proxy's way. Throws IoError, CorruptTile.
  // O(segments).
  void writePicture(const std::string& path, const std::string& title, const RunSummary& summary,
                    const TileStore& store) const;

 private:
  std::vector<double> time_s_, force_N_;
  std::vector<Vector3d> way_W_;
  std::vector<double> frontier_s_;  // the first tick of each stretch
  bool at_frontier_ = false;
};

}  // namespace filiform::tools
