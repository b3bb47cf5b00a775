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

std::vector<NearestResult> Nearest::inBox(const Vector3d& lo_W, const Vector3d& hi_W, bool of_cells) const {
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
  std::vector<internal::Unsure<Candidate>> ghosts;
  std::uint32_t tiles_read = 0, tiles_searched = 0;
  std::vector<TileId> tiles;
  for (const auto& [tile, tile_box] : set_->tilesMeeting(region, tiles_read)) tiles.push_back(tile);
  internal::TileRounds rounds(set_->store, set_->cache, internal::TileRounds::kMost);
  for (const TileId tile_id : tiles) {
    rounds.before(tiles_searched++, tiles);
    set_->forEachIn(region, tile_id, tiles_read, [&](const Tile& tile, std::uint32_t s, bool is_sure) {
      if (!segmentMeetsBox(tile.gridPoint(tile.child(s)), tile.gridPoint(tile.parent(s)), box)) return;
      const ClosestPoint c = closestPoint(tile.position_W(tile.child(s)), tile.position_W(tile.parent(s)), middle_W);
      const Candidate candidate{c.squared_distance, tile.segmentId(s), c.t, c.p_W, tile.id()};
      if (is_sure)
        found.push_back(candidate);
      else
        ghosts.push_back({candidate, set_->middleOf(tile, s)});
    });
  }
  set_->readOwnersAhead(ghosts);
  for (const auto& ghost : ghosts)
    if (set_->wants(ghost.found.segment, ghost.middle, tiles_read)) found.push_back(ghost.found);
  std::sort(found.begin(), found.end());
  keepFirst(found, of_cells);
  std::vector<NearestResult> results;
  results.reserve(found.size());
  for (const Candidate& c : found)
    results.push_back({static_cast<std::uint32_t>(results.size()), std::sqrt(c.squared_distance), c.p_W, c.segment, c.t,
                       c.tile, true, tiles_read, tiles_searched});
  return results;
}

}  // namespace filiform
