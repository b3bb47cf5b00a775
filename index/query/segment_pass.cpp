#include "index/query/segment_pass.h"

#include "index/geometry/partition.h"
#include "index/query/internal/owned_segments.h"
#include "index/query/tile_finder.h"
#include "index/set/reads_at_once.h"
#include "index/set/tiles_ahead.h"
#include "index/tile/box_region.h"
#include "index/workers.h"

#include <algorithm>
#include <mutex>
#include <numeric>
#include <set>

namespace filiform {
namespace {

std::vector<TileId> allTiles(const TileStore& store) {
  std::vector<TileId> tiles(store.tile_count());
  std::iota(tiles.begin(), tiles.end(), TileId{0});
  return tiles;
}

class Pass {
 public:
  Pass(const TileStore& store, const SegmentPass& pass,
       const std::function<void(TileId, std::span<const PassedSegment>)>& visit)
      : store_(store), pass_(pass), visit_(visit) {
    if (!pass.cells) return;
    wanted_.resize(store.cell_count());
    for (const std::uint32_t cell : *pass.cells) wanted_[cell] = true;
  }

  void run() {
    if (!pass_.box) {
      tiles_ = pass_.cells ? tilesOf(store_, *pass_.cells) : allTiles(store_);
      visitTiles(false);
      return;
    }
    const Grid grid = store_.grid();
    const BoxRegion region({grid.toWorld(pass_.box->lo), grid.toWorld(pass_.box->hi)});
    for (const auto& hit : TileFinder(store_).meeting(region)) tiles_.push_back(hit.first);
    if (store_.long_tile() != kNoTile) tiles_.push_back(store_.long_tile());
    visitTiles(true);
    tiles_.assign(owners_.begin(), owners_.end());
    visitTiles(false);
  }

 private:
  bool wants(std::uint32_t cell) const { return !pass_.cells || wanted_[cell]; }

  void visitTiles(bool note_owners) {
    TilesAhead ahead(store_, tiles_, pass_.with_appearance, TilesAhead::Reads::background, pass_.threads);
    for (const TileId id : tiles_) {
      if (pass_.check) pass_.check();
      const auto [tile, appearance] = ahead.next();
      segments_.clear();
      internal::appendOwned(*tile, pass_.with_appearance ? &appearance : nullptr, segments_);
      if (pass_.cells || pass_.box)
        std::erase_if(segments_, [&](const PassedSegment& s) {
          return !wants(s.id.cell) || (pass_.box && !segmentMeetsBox(s.child, s.parent, *pass_.box));
        });
      if (note_owners) noteOwners(*tile);
      if (!segments_.empty()) visit_(id, segments_);
    }
  }

  // A segment of the box may belong to a tile that does not meet the box.
  void noteOwners(const Tile& tile) {
    tile.forEachSegment([&](std::uint32_t segment, std::uint32_t child, std::uint32_t parent) {
      if (tile.owned(segment) || !wants(tile.segmentId(segment).cell)) return;
      const GridPoint a = tile.gridPoint(child), b = tile.gridPoint(parent);
      if (!segmentMeetsBox(a, b, *pass_.box)) return;
      const TileId owner = store_.home(midpoint(a, b));
      if (owner != kNoTile && !std::binary_search(tiles_.begin(), tiles_.end(), owner)) owners_.insert(owner);
    });
  }

  const TileStore& store_;
  const SegmentPass& pass_;
  const std::function<void(TileId, std::span<const PassedSegment>)>& visit_;
  std::vector<bool> wanted_;  // by cell; only with pass_.cells
  std::vector<TileId> tiles_;
  std::set<TileId> owners_;
  std::vector<PassedSegment> segments_;
};

}  // namespace

void forEachSegment(const TileStore& store, const SegmentPass& pass,
                    const std::function<void(TileId tile, std::span<const PassedSegment> segments)>& visit) {
  Pass(store, pass, visit).run();
}

std::vector<TileId> tilesOf(const TileStore& store, std::span<const std::uint32_t> cells) {
  if (cells.size() == store.cell_count()) return allTiles(store);
  std::vector<std::uint8_t> needed(store.tile_count());
  std::mutex mutex;
  runItems(cells.size(), readsAtOnce(store), [&](std::size_t i) {
    const std::vector<TileId> tiles = store.cellTiles(cells[i]);
    const std::lock_guard lock(mutex);
    for (const TileId tile : tiles) needed[tile] = 1;
  });
  std::vector<TileId> tiles;
  for (TileId tile = 0; tile < needed.size(); ++tile)
    if (needed[tile] != 0) tiles.push_back(tile);
  return tiles;
}

}  // namespace filiform
