// What the searches of Nearest share: the store, the filter, the finder of tiles, and the tiles in memory. Thread rule:
// internally synchronised.
#pragma once

#include "index/file/internal/read_once.h"
#include "index/geometry/partition.h"
#include "index/query/internal/landmark_hint.h"
#include "index/query/internal/segment_sieve.h"
#include "index/query/internal/tile_cache.h"
#include "index/query/tile_finder.h"
#include "index/set/forwarding_store.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace filiform::internal {

// A result that is one if the tile that owns its segment says so.
template <class Found>
struct Unsure {
  Found found;
  GridPoint middle;  // of the segment: in the block of that tile

  bool operator<(const Unsure& other) const { return found < other.found; }
};

// A store whose tiles are taken from a cache if they are there.
struct CachedStore final : ForwardingStore {
  CachedStore(const TileStore& store, TileCache& c) : ForwardingStore(store), cache(c) {}
  std::shared_ptr<const Tile> load(TileId tile) const override {
    const TileCache::Lease here = cache.find(tile);
    return here ? here->tile : store_.loadToSearch(tile);
  }
  TileCache& cache;
};

class SearchedSet {
 public:
  // Throws as SegmentSieve.
  SearchedSet(const TileStore& s, const SegmentFilter& filter, TileEngineKind engine, std::uint64_t budget_bytes)
      : store(s), sieve(s, filter), hint(s), cache(s, sieve, engine, budget_bytes), filter_(filter), all_tiles_(s) {}

  const TileStore& store;
  const SegmentSieve sieve;
  const LandmarkHint hint;
  mutable TileCache cache;
  const CachedStore cached{store, cache};

  // Finds the tiles to search. The first call may read the tiles of a few wanted cells; see nearest.h.
  const TileFinder& finder(std::uint32_t& tiles_read) const;
  // True: finder() lists the tiles that own segments of the wanted cells, with boxes of these segments, and no other
  // tile matters. Call it after finder().
  bool isOfCells() const { return plan_.known() != nullptr && plan_.known()->of_cells != nullptr; }
  bool isPlanned() const { return !sieve.ofCells() || plan_.known() != nullptr; }
  // The tile that finder() does not contain, or kNoTile.
  TileId long_tile() const { return isOfCells() ? kNoTile : store.long_tile(); }
  bool mayHold(TileId tile) const { return !sieve.ofTypes() || sieve.mayHold(store.entry(tile)); }

  std::vector<std::pair<TileId, WorldBox>> tilesMeeting(const Region& region, std::uint32_t& tiles_read) const {
    auto tiles = finder(tiles_read).meeting(region);
    if (sieve.ofTypes()) std::erase_if(tiles, [this](const auto& tile) { return !mayHold(tile.first); });
    if (long_tile() != kNoTile) tiles.emplace_back(long_tile(), WorldBox{Vector3d::Zero(), Vector3d::Zero()});
    return tiles;
  }

  // Calls use(tile, segment, is_sure) for the segments that the tile's engines cannot exclude.
  template <typename Use>
  void forEachIn(const Region& region, TileId id, std::uint32_t& tiles_read, const Use& use) const {
    const auto loaded = cache.get(id, tiles_read);
    std::vector<std::uint32_t> segments;
    loaded->engine->collect(region, segments);
    const std::size_t sure = segments.size();
    if (loaded->ghosts != nullptr) loaded->ghosts->collect(region, segments);
    for (std::size_t i = 0; i < segments.size(); ++i) use(*loaded->tile, segments[i], i < sure);
  }

  static GridPoint middleOf(const Tile& tile, std::uint32_t segment) {
    return midpoint(tile.gridPoint(tile.child(segment)), tile.gridPoint(tile.parent(segment)));
  }
  // The tile that tells whether a ghost is wanted. kNoTile: it is not, unless the long-segment tile, which every search
  // visits, owns it.
  TileId ownerOf(const GridPoint& middle) const {
    const TileId owner = store.home(middle);
    return owner != kNoTile && mayHold(owner) ? owner : kNoTile;
  }
  static bool wants(const SearchTile& owner, SegmentId id) {
    const auto segment = owner.tile->findSegment(id);
    return segment && (*owner.wanted)[*segment];
  }
  bool wants(SegmentId id, const GridPoint& middle, std::uint32_t& tiles_read) const {
    const TileId owner = ownerOf(middle);
    return owner != kNoTile && wants(*cache.get(owner, tiles_read), id);
  }
  // Settles ghosts of a searched tile by the tiles in memory; see TileCache.
  void settleGhosts(TileId id) const {
    cache.settleGhosts(id, [this](const Tile& tile, std::uint32_t segment) -> std::optional<bool> {
      const TileId owner = ownerOf(middleOf(tile, segment));
      if (owner == kNoTile) return false;
      const TileCache::Lease here = cache.find(owner);
      return here ? std::optional(wants(*here, tile.segmentId(segment))) : std::nullopt;
    });
  }
  // From far away, reads the tiles that own these, many at once.
  template <class Found>
  void readOwnersAhead(const std::vector<Unsure<Found>>& unsure) const {
    if (!store.isRemote()) return;
    std::vector<TileId> owners;
    for (const Unsure<Found>& one : unsure)
      if (const TileId owner = ownerOf(one.middle); owner != kNoTile) owners.push_back(owner);
    cache.readAhead(owners);
  }

 private:
  struct Plan {
    std::unique_ptr<const TileFinder> of_cells;  // null: all tiles are searched
  };
  std::unique_ptr<const Plan> makePlan(std::uint32_t& tiles_read) const;
  std::unique_ptr<const TileFinder> findTilesOf(const std::vector<std::uint32_t>& cells,
                                                std::uint32_t& tiles_read) const;

  const SegmentFilter filter_;
  const TileFinder all_tiles_;
  mutable ReadOnce<Plan> plan_;
};

}  // namespace filiform::internal
