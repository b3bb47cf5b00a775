// What the searches of Nearest share: the store, the finder of tiles, and the tiles in memory. Thread rule: internally
// synchronised.
#pragma once

#include "index/query/internal/landmark_hint.h"
#include "index/query/internal/tile_cache.h"
#include "index/query/tile_finder.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace filiform::internal {

struct SearchedSet {
  const TileStore& store;
  const TileFinder finder;
  const LandmarkHint hint;
  mutable TileCache cache;

  SearchedSet(const TileStore& s, std::string engine, std::uint64_t budget_bytes)
      : store(s), finder(s), hint(s), cache(s, std::move(engine), budget_bytes) {}

  // The tile finder does not contain the long-segment tile.
  std::vector<std::pair<TileId, WorldBox>> tilesMeeting(const Region& region) const {
    auto tiles = finder.meeting(region);
    if (store.long_tile() != kNoTile)
      tiles.emplace_back(store.long_tile(), WorldBox{Vector3d::Zero(), Vector3d::Zero()});
    return tiles;
  }

  // Calls use(tile, segment) for the segments that the tile's engine cannot exclude.
  template <typename Region, typename Use>
  void forEachIn(const Region& region, TileId id, std::uint32_t& tiles_read, const Use& use) const {
    const auto loaded = cache.get(id, tiles_read);
    std::vector<std::uint32_t> segments;
    loaded->engine->collect(region, segments);
    for (const std::uint32_t s : segments) use(*loaded->tile, s);
  }
};

}  // namespace filiform::internal
