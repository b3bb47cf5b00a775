// The pictures of one navigation run: the force curve, and the scene with the path of the proxy. Thread rule:
// thread-compatible.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/run/run.h"

#include <string>
#include <vector>

namespace filiform::tools {

class TravelReport {
 public:
  // Keeps 48 bytes of a tick for the pictures.
  void add(const TickRow& row);

  // Draws force against time; dashed lines show frontiers. Throws IoError. O(ticks).
  void writeForcePlot(const std::string& path, const std::string& title, const RunSummary& summary) const;
  // Draws the scene from the front as `filiform render` does, and the path of the proxy over it. Throws GraphicsError
  // without OpenGL 3.3, IoError, CorruptTile.
  void writePicture(const std::string& path, const std::string& title, const RunSummary& summary,
                    const TileStore& store) const;

 private:
  std::vector<double> time_s_, force_N_;
  std::vector<Vector3d> way_W_;
  std::vector<double> frontier_s_;  // times at which the proxy came to a frontier
  bool at_frontier_ = false;
};

}  // namespace filiform::tools
