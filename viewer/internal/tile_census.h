// What the panel of tiles shows: states, rates, and boxes about the proxy. Thread rule: one owner.
#pragma once

#include "index/tile_store.h"
#include "viewer/panels.h"

namespace filiform::internal {

// `residency`: nullptr for a scene in memory. Rates are those since `before`, `since_s` ago. O(1), with the boxes
// O(tiles).
TilePanel countTiles(const TileStore& store, const Residency* residency, const TilePanel& before, double since_s);
// Adds the counts by state, and the boxes of the tiles nearest to that place.
void listTiles(const TileStore& store, const Residency* residency, const Vector3d& p_W, TilePanel& panel);

}  // namespace filiform::internal
