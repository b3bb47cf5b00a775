// What the searches of Nearest share: the store, the finder of tiles, and the tiles in memory. Thread rule: internally
// synchronised.
#pragma once

#include "index/query/internal/landmark_hint.h"
#include "index/query/internal/tile_cache.h"
#include "index/query/nearest.h"
#include "index/query/tile_finder.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace filiform {

struct Nearest::Impl {
  const TileStore& store;
  const TileFinder finder;
  const LandmarkHint hint;
  mutable internal::TileCache cache;

  Impl(const TileStore& s, const NearestOptions& options) : store(s), finder(s), hint(s), cache(s, options) {}

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

  struct Search;  // for the nearest segments to a point
  void visit(Search& s, TileId tile) const;
  // The tile whose block contains the point, if its content does too. No tile can be nearer, so it must be searched in
  // any case. Its result bounds the rest without the landmarks.
  TileId homeOf(const Vector3d& h_W) const;
  // True if the ball lies inside the tile's block: no other tile can then hold a result.
  bool answersAlone(TileId tile, const Vector3d& h_W, double squared_radius) const;
  // The home and the tiles of its page of the directory that come next: from far away, a round of reads costs more than
  // a few tiles. Other pages are not read for this.
  std::vector<TileId> besideHome(TileId home, const Vector3d& h_W) const;
  void searchAll(Search& s) const;
  void searchResident(Search& s) const;
};

}  // namespace filiform
