#include "index/query/internal/searched_set.h"

#include "index/set/reads_at_once.h"
#include "index/workers.h"

#include <algorithm>
#include <limits>
#include <mutex>

namespace filiform::internal {
namespace {

constexpr std::size_t kFewCells = 1024;
constexpr std::uint64_t kFewOfSegments = 16;  // at most a 16th of all

}  // namespace

const TileFinder& SearchedSet::finder(std::uint32_t& tiles_read) const {
  if (!sieve.ofCells()) return all_tiles_;
  const Plan& plan = plan_.get([&] { return makePlan(tiles_read); });
  return plan.of_cells ? *plan.of_cells : all_tiles_;
}

std::unique_ptr<const SearchedSet::Plan> SearchedSet::makePlan(std::uint32_t& tiles_read) const {
  const std::vector<std::uint32_t>& cells = *filter_.cells;
  auto plan = std::make_unique<Plan>();
  if (cells.size() > kFewCells) return plan;
  std::uint64_t segments = 0;
  for (const std::uint32_t cell : cells) segments += store.cell(cell).segments + store.cell(cell).isolated;
  if (segments > store.segmentCount() / kFewOfSegments) return plan;
  plan->of_cells = findTilesOf(cells, tiles_read);
  return plan;
}

std::unique_ptr<const TileFinder> SearchedSet::findTilesOf(const std::vector<std::uint32_t>& cells,
                                                           std::uint32_t& tiles_read) const {
  cache.leaveGhostsOut();
  std::mutex mutex;
  std::vector<TileId> tiles;
  runItems(cells.size(), store.isRemote() ? mostReadThreads() : 1, [&](std::size_t i) {
    const std::vector<TileId> some = store.cellTiles(cells[i]);
    const std::lock_guard lock(mutex);
    tiles.insert(tiles.end(), some.begin(), some.end());
  });
  std::sort(tiles.begin(), tiles.end());
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  std::vector<std::pair<TileId, WorldBox>> boxes;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (!mayHold(tiles[i])) continue;
    if (store.isRemote() && i % TileCache::kLeastAhead == 0)
      cache.readAhead(std::span(tiles).subspan(i, std::min(TileCache::kLeastAhead, tiles.size() - i)));
    constexpr double kInf = std::numeric_limits<double>::infinity();
    WorldBox box{Vector3d::Constant(kInf), Vector3d::Constant(-kInf)};
    forEachIn(Everywhere(), tiles[i], tiles_read, [&](const Tile& tile, std::uint32_t s, bool) {
      for (const std::uint32_t node : {tile.child(s), tile.parent(s)}) {
        box.lo_W = box.lo_W.cwiseMin(tile.position_W(node));
        box.hi_W = box.hi_W.cwiseMax(tile.position_W(node));
      }
    });
    if (box.lo_W.x() <= box.hi_W.x()) boxes.emplace_back(tiles[i], box);
  }
  return std::make_unique<TileFinder>(store, std::move(boxes));
}

}  // namespace filiform::internal
