// What a tile holds of the segments that it owns. Functions without state.
#pragma once

#include "index/tile/passed_segment.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace filiform::internal {

// Calls use(segment) for the owned ones among the tile's segments from `first` on, ascending, until it returns false.
// `appearance`: that of the tile; nullptr: without.
template <class Use>
void forEachOwned(const Tile& tile, const TileAppearance* appearance, std::uint32_t first, const Use& use) {
  if (first >= tile.segment_count()) return;
  std::uint32_t owned = first == 0 ? 0 : tile.ownedIndex(first), last_child = UINT32_MAX;
  GridPoint last = GridPoint::Zero();
  Tile::Link link = tile.link(first);
  for (std::uint32_t segment = first;;) {
    if (tile.owned(segment)) {
      PassedSegment s{link.id, link.child_id.sample, link.parent_id.sample, tile.gridPoint(link.child), last};
      // Mostly the child of the segment before: its position is known.
      if (link.parent != last_child) s.parent = tile.gridPoint(link.parent);
      last_child = link.child;
      last = s.child;
      if (appearance != nullptr) {
        s.radius_um = appearance->radii_um[owned];
        s.type = appearance->types[owned];
      }
      ++owned;
      if (!use(std::as_const(s))) return;
    }
    if (++segment == tile.segment_count()) return;
    if (tile.isBetween(link.child)) {  // the next segment goes on from the child
      link = {{link.id.cell, link.id.segment + 1},
              link.child + 1,
              link.child,
              {link.id.cell, link.child_id.sample + 1},
              link.child_id};
    } else {
      link = tile.link(segment);
    }
  }
}

// Appends the owned segments of the tile, ascending.
void appendOwned(const Tile& tile, const TileAppearance* appearance, std::vector<PassedSegment>& segments);
// Only those of one cell. O(log segments of the tile + segments of the cell in it).
void appendOwned(const Tile& tile, const TileAppearance* appearance, std::uint32_t cell,
                 std::vector<PassedSegment>& segments);

}  // namespace filiform::internal
