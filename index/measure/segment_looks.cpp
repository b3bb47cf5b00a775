#include "index/measure/segment_looks.h"

#include "index/errors.h"
#include "index/geometry/partition.h"
#include "index/measure/internal/sample_radii.h"
#include "index/set/tiles_ahead.h"

#include <algorithm>
#include <string>

namespace filiform {

SegmentLooks::SegmentLooks(const TileStore& store, std::uint64_t budget_bytes)
    : radii_(std::make_unique<internal::SampleRadii>(store, budget_bytes)) {}
SegmentLooks::~SegmentLooks() = default;

SegmentLook SegmentLooks::lookAt(const Tile& owner, const TileAppearance& appearance, std::uint32_t segment, double t) {
  const Tile::Link link = owner.link(segment);
  const std::uint32_t at = owner.ownedIndex(segment);
  const double child_um = appearance.radii_um[at];
  if (t == 0) return {appearance.types[at], child_um};
  // Mostly, the segment before ends at the parent.
  const bool follows = segment > 0 && owner.child(segment - 1) == link.parent && owner.owned(segment - 1);
  const double parent_um =
      follows ? appearance.radii_um[at - 1] : radii_->of(link.parent_id, owner.gridPoint(link.parent));
  return {appearance.types[at], t == 1 ? parent_um : child_um + t * (parent_um - child_um)};
}

std::vector<SegmentLook> SegmentLooks::ofPlaces(std::span<const Place> places) {
  const TileStore& store = radii_->tiles();
  std::vector<SegmentLook> looks(places.size());
  // The owner of a segment is the tile that stores it, that of its middle, or the long-segment tile.
  struct Search {
    TileId tile;
    std::size_t place;
    bool is_home = false;
  };
  std::vector<Search> searches;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (places[i].tile != kNoTile) searches.push_back({places[i].tile, i});
  while (!searches.empty()) {
    std::sort(searches.begin(), searches.end(), [](const Search& a, const Search& b) { return a.tile < b.tile; });
    std::vector<TileId> ids;
    for (const Search& search : searches)
      if (ids.empty() || ids.back() != search.tile) ids.push_back(search.tile);
    TilesAhead ahead(store, ids, true, TilesAhead::Reads::awaited);
    TilesAhead::Loaded loaded;
    std::vector<Search> next;
    for (const Search& search : searches) {
      if (!loaded.tile || loaded.tile->id() != search.tile) loaded = ahead.next();
      const Tile& tile = *loaded.tile;
      const Place& place = places[search.place];
      const std::optional<std::uint32_t> segment = tile.findSegment(place.segment);
      if (segment && tile.owned(*segment)) {
        looks[search.place] = lookAt(tile, loaded.appearance, *segment, place.t);
      } else if (segment && !search.is_home) {
        const TileId home =
            store.home(midpoint(tile.gridPoint(tile.child(*segment)), tile.gridPoint(tile.parent(*segment))));
        next.push_back({home != kNoTile && home != search.tile ? home : store.long_tile(), search.place, true});
      } else if (search.tile != store.long_tile()) {
        next.push_back({store.long_tile(), search.place, true});
      } else {
        next.push_back({kNoTile, search.place});
      }
      if (!next.empty() && next.back().tile == kNoTile)
        throw CorruptSet("cell " + std::to_string(place.segment.cell) + " of the tile set", 0,
                         "no tile owns segment " + std::to_string(place.segment.segment));
    }
    searches = std::move(next);
  }
  return looks;
}

}  // namespace filiform
