// The content of the tile panel: tile states, read rates, and the boxes of the tiles near the proxy.
#pragma once

#include "index/query/tile_finder.h"
#include "index/set/tile_store.h"
#include "viewer/window/panels/panel_data.h"

#include <cstddef>
#include <vector>

namespace filiform::internal {

struct NearTile {
  TileId tile;
  Vector3d lo_W, hi_W;  // of its content
};

// Thread rule: internally synchronised. Reads pages of directory.bin: do not use it on the thread that draws.
class TileCensus {
 public:
  static constexpr std::size_t kMost = 3000;

  // The store must outlive it.
  explicit TileCensus(const TileStore& store) : store_(store), finder_(store) {}
  // The tiles whose content is nearest to a place, nearest first, at most `most`, without the long-segment tile. Throws
  // CorruptSet, IoError from the store. O(most log tiles), plus reads of pages that were not needed before.
  std::vector<NearTile> nearest(const Vector3d& p_W, std::size_t most = kMost) const;

 private:
  const TileStore& store_;
  TileFinder finder_;
};

// Counters and rates. `residency`: nullptr for a scene in memory. The rates are averages since `before`, which was
// made `since_s` ago. Reads nothing from the disk. O(1).
TilePanel countTiles(const TileStore& store, const Residency* residency, const TilePanel& before, double since_s);
// Adds the number of tiles in each state, and the boxes of the tiles in `near`. Reads nothing from the disk. O(near +
// tiles that are not absent).
void showTiles(const std::vector<NearTile>& near, const Residency* residency, TilePanel& panel);

}  // namespace filiform::internal
