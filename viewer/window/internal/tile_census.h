// What the panel of tiles shows: states, rates, and boxes about the proxy.
#pragma once

#include "index/query/tile_finder.h"
#include "index/set/tile_store.h"
#include "viewer/window/panels.h"

#include <cstddef>
#include <vector>

namespace filiform::internal {

struct NearTile {
  TileId tile;
  Vector3d lo_W, hi_W;  // of its content
};

// Thread rule: internally synchronised; reads pages of the directory, so not for the thread that draws.
class TileCensus {
 public:
  static constexpr std::size_t kMost = 3000;

  explicit TileCensus(const TileStore& store) : store_(store), finder_(store) {}  // which must outlive it
  // The tiles with content nearest to a place, nearest first, at most `most`; the long-segment tile is not among them.
  // Throws CorruptSet, IoError from the store. O(most log tiles), and the pages of these tiles at the first time.
  std::vector<NearTile> nearest(const Vector3d& p_W, std::size_t most = kMost) const;

 private:
  const TileStore& store_;
  TileFinder finder_;
};

// Counters and rates. `residency`: nullptr for a scene in memory. Rates are those since `before`, `since_s` ago. Reads
// nothing. O(1).
TilePanel countTiles(const TileStore& store, const Residency* residency, const TilePanel& before, double since_s);
// Adds the numbers of tiles by state, and the boxes of these tiles. Reads nothing. O(near + tiles that are not absent).
void showTiles(const std::vector<NearTile>& near, const Residency* residency, TilePanel& panel);

}  // namespace filiform::internal
