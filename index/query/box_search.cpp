// Nearest::inBox().
#include "index/errors.h"
#include "index/geometry/closest_point.h"
#include "index/geometry/partition.h"
#include "index/query/internal/searched_set.h"
#include "index/query/internal/tile_rounds.h"
#include "index/query/nearest.h"
#include "index/tile/box_region.h"

#include <algorithm>
#include <cmath>

namespace filiform {

std::vector<NearestResult> Nearest::inBox(const Vector3d& lo_W, const Vector3d& hi_W) const {
  if (!lo_W.allFinite() || !hi_W.allFinite() || (lo_W.array() > hi_W.array()).any())
    throw UsageError("a box needs six finite coordinates, in um: the lowest corner, then the highest");
  const Grid grid = set_->store.grid();
  const auto snapped = [&](const Vector3d& p_W) {
    constexpr double kEdge = Grid::kMaxCoordinate_um;
    return grid.snap(p_W.cwiseMax(-kEdge).cwiseMin(kEdge));
  };
  const GridBox box{snapped(lo_W), snapped(hi_W)};
  const BoxRegion region({grid.toWorld(box.lo), grid.toWorld(box.hi)});
  const Vector3d middle_W = 0.5 * (region.box.lo_W + region.box.hi_W);

  std::vector<Candidate> found;
  std::uint32_t tiles_read = 0, tiles_searched = 0;
  std::vector<TileId> tiles;
  for (const auto& [tile, tile_box] : set_->tilesMeeting(region)) tiles.push_back(tile);
  internal::TileRounds rounds(set_->store, set_->cache, internal::TileRounds::kMost);
  for (const TileId tile_id : tiles) {
    rounds.before(tiles_searched++, tiles);
    set_->forEachIn(region, tile_id, tiles_read, [&](const Tile& tile, std::uint32_t s) {
      if (!segmentMeetsBox(tile.gridPoint(tile.child(s)), tile.gridPoint(tile.parent(s)), box)) return;
      const ClosestPoint c = closestPoint(tile.position_W(tile.child(s)), tile.position_W(tile.parent(s)), middle_W);
      found.push_back({c.squared_distance, tile.segmentId(s), c.t, c.p_W, tile.id()});
    });
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end(),
                          [](const Candidate& a, const Candidate& b) { return a.segment == b.segment; }),
              found.end());
  std::vector<NearestResult> results;
  results.reserve(found.size());
  for (const Candidate& c : found)
    results.push_back({static_cast<std::uint32_t>(results.size()), std::sqrt(c.squared_distance), c.p_W, c.segment, c.t,
                       c.tile, true, tiles_read, tiles_searched});
  return results;
}

}  // namespace filiform
