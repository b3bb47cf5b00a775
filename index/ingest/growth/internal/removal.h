// Removal: takes cells out of the tiles of a set.
#pragma once

#include "index/ingest/growth/internal/grown_revision.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace filiform::internal {

// What remains of the tiles of a set without some of its cells. `removed`: by cell; empty: none. Both arguments must
// outlive the object. Members throw what the set throws.
class TilesWithout {
 public:
  TilesWithout(const TileSet& base, const std::vector<bool>& removed);  // O(tiles + segments of the tiles touched)
  const std::vector<TileId>& touched() const { return touched_; }       // that hold a segment of the cells, ascending
  bool touches(TileId tile) const;
  // The other segments of a tile, and the attributes of those that the tile owns.
  std::pair<std::vector<StoredSegment>, TileAppearance> left(TileId tile) const;

 private:
  const TileSet& base_;
  const std::vector<bool>& removed_;
  std::vector<TileId> touched_;
};

// Passes all tiles of the new revision to `to` and numbers them: those that hold a segment of the cells are written
// without it, or dropped if nothing is left. step(done, total) is called for each such tile. Throws what the set and
// the revision throw. O(tiles + segments of those tiles).
void removeFromTiles(const TileSet& base, const std::vector<bool>& removed, GrownRevision& to,
                     const std::function<void(std::uint64_t done, std::uint64_t total)>& step);

// The landmarks that lie on other cells. The radius grows by the distance from a removed landmark to the nearest that
// remains. If none remains, any sample of the other cells becomes one. O(landmarks log landmarks) expected.
Landmarks withoutCells(const TileSet& base, const std::vector<bool>& removed, const GridBox& bounds);

// Both, with the cells of `added` numbered after the first `cells`. Of several landmarks at one position, the one with
// the lowest segment stays.
Landmarks withLandmarks(const Landmarks& base, const Landmarks& added, std::uint32_t cells);

}  // namespace filiform::internal
