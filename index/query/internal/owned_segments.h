// What a tile holds of the segments that it owns. Functions without state.
#pragma once

#include "index/tile/passed_segment.h"

#include <vector>

namespace filiform::internal {

// Appends the owned segments of the tile, ascending. `appearance`: that of the tile; nullptr: without.
void appendOwned(const Tile& tile, const TileAppearance* appearance, std::vector<PassedSegment>& segments);
// Only those of one cell. O(log segments of the tile + segments of the cell in it).
void appendOwned(const Tile& tile, const TileAppearance* appearance, std::uint32_t cell,
                 std::vector<PassedSegment>& segments);

}  // namespace filiform::internal
