// SegmentLooks: the types of segments that a search found, and the radii at the places found.
//
//   SegmentLooks looks(nearest.tiles(), 64 << 20);
//   for (const SegmentLook& look : looks.of(nearest.find(p_W, {.k = 3}))) std::cout << look.radius_um << '\n';
//
// Thread rule: internally synchronised; the haptic thread must not call it.
#pragma once

#include "index/set/tile_store.h"

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace filiform {

namespace internal {
class SampleRadii;
}

struct SegmentLook {
  std::optional<std::uint16_t> type{};                          // of the segment's child; nullopt: not read
  double radius_um = std::numeric_limits<double>::quiet_NaN();  // at the place; NaN: unknown
};

class SegmentLooks {
 public:
  // Keeps tiles up to `budget_bytes` between calls. The store must outlive this object; Nearest::tiles() saves reads.
  SegmentLooks(const TileStore& store, std::uint64_t budget_bytes);
  ~SegmentLooks();

  // The looks of results of Nearest, in their order. The radius changes linearly between the radii of child and parent,
  // and is unknown if one that counts is. Results without a tile, those of an approximate search, have no look. Reads
  // each tile and its appearance once; from a set at an address, many at once. Throws CorruptSet, CorruptTile, IoError.
  // O(results log results + segments of the tiles).
  template <class Found>
  std::vector<SegmentLook> of(const std::vector<Found>& found) {
    std::vector<Place> places;
    places.reserve(found.size());
    for (const Found& one : found) places.push_back({one.segment, one.tile, one.t});
    return ofPlaces(places);
  }
  // The same for lists, as one list.
  template <class Found>
  std::vector<SegmentLook> of(const std::vector<std::vector<Found>>& found) {
    std::vector<Place> places;
    for (const std::vector<Found>& some : found)
      for (const Found& one : some) places.push_back({one.segment, one.tile, one.t});
    return ofPlaces(places);
  }

 private:
  struct Place {
    SegmentId segment;
    TileId tile;
    double t;
  };
  std::vector<SegmentLook> ofPlaces(std::span<const Place> places);
  SegmentLook lookAt(const Tile& owner, const TileAppearance& appearance, std::uint32_t segment, double t);

  const std::unique_ptr<internal::SampleRadii> radii_;
};

}  // namespace filiform
