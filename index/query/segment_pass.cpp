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
#include <utility>

namespace filiform {
namespace {

std::vector<TileId> allTiles(const TileStore& store) {
  std::vector<TileId> tiles(store.tile_count());
  std::iota(tiles.begin(), tiles.end(), TileId{0});
  return tiles;
}

}  // namespace

struct SegmentReader::Impl {
  Impl(const TileStore& s, SegmentPass p) : store(s), pass(std::move(p)) {
    if (!pass.cells) return;
    wanted.resize(store.cell_count());
    for (const std::uint32_t cell : *pass.cells) wanted[cell] = true;
  }

  bool wants(std::uint32_t cell) const { return !pass.cells || wanted[cell]; }

  void beginTiles(std::vector<TileId> list) {
    tiles = std::move(list);
    taken = 0;
    ahead.emplace(store, tiles, pass.with_appearance, TilesAhead::Reads::background, pass.threads);
  }

  std::vector<TileId> firstTiles() const {
    if (!pass.box) return pass.cells ? tilesOf(store, *pass.cells) : allTiles(store);
    std::vector<TileId> list;
    const Grid grid = store.grid();
    const BoxRegion region({grid.toWorld(pass.box->lo), grid.toWorld(pass.box->hi)});
    for (const auto& hit : TileFinder(store).meeting(region)) list.push_back(hit.first);
    if (store.long_tile() != kNoTile) list.push_back(store.long_tile());
    return list;
  }

  // False after the last tile.
  bool hasTile() {
    if (!ahead) {
      notes_owners = pass.box.has_value();
      beginTiles(firstTiles());
    }
    if (taken == tiles.size() && notes_owners) {
      notes_owners = false;
      beginTiles({owners.begin(), owners.end()});
    }
    return taken < tiles.size();
  }

  void takeTile() {
    if (pass.check) pass.check();
    id = tiles[taken++];
    const auto [tile, appearance] = ahead->next();
    segments.clear();
    internal::appendOwned(*tile, pass.with_appearance ? &appearance : nullptr, segments);
    if (pass.cells || pass.box)
      std::erase_if(segments, [&](const PassedSegment& s) {
        return !wants(s.id.cell) || (pass.box && !segmentMeetsBox(s.child, s.parent, *pass.box));
      });
    if (notes_owners) noteOwners(*tile);
  }

  // A segment of the box may belong to a tile that does not meet the box.
  void noteOwners(const Tile& tile) {
    tile.forEachSegment([&](std::uint32_t segment, std::uint32_t child, std::uint32_t parent) {
      if (tile.owned(segment) || !wants(tile.segmentId(segment).cell)) return;
      const GridPoint a = tile.gridPoint(child), b = tile.gridPoint(parent);
      if (!segmentMeetsBox(a, b, *pass.box)) return;
      const TileId owner = store.home(midpoint(a, b));
      if (owner != kNoTile && !std::binary_search(tiles.begin(), tiles.end(), owner)) owners.insert(owner);
    });
  }

  const TileStore& store;
  const SegmentPass pass;
  std::vector<bool> wanted;  // by cell; only with pass.cells
  std::vector<TileId> tiles;
  std::size_t taken = 0;
  std::optional<TilesAhead> ahead;
  bool notes_owners = false;
  std::set<TileId> owners;
  std::vector<PassedSegment> segments;
  TileId id = kNoTile;
};

SegmentReader::SegmentReader(const TileStore& store, SegmentPass pass)
    : impl_(std::make_unique<Impl>(store, std::move(pass))) {}
SegmentReader::~SegmentReader() = default;

std::span<const PassedSegment> SegmentReader::next() {
  while (impl_->hasTile()) {
    impl_->takeTile();
    if (!impl_->segments.empty()) return impl_->segments;
  }
  return {};
}

TileId SegmentReader::tile() const { return impl_->id; }

void forEachSegment(const TileStore& store, const SegmentPass& pass,
                    const std::function<void(TileId tile, std::span<const PassedSegment> segments)>& visit) {
  SegmentReader reader(store, pass);
  for (auto segments = reader.next(); !segments.empty(); segments = reader.next()) visit(reader.tile(), segments);
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
