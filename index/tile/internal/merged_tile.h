// Rebuilds a tile from its segments: with the segments of a patch, or without some cells.
#pragma once

#include "index/tile/tile.h"

#include <vector>

namespace filiform::internal {

// Appends the tile's segments, in the order of their ids. O(segments).
void appendSegments(const Tile& tile, std::vector<StoredSegment>& segments);
void appendAppearance(const TileAppearance& look, TileAppearance& to);

// A bound of Tile::bytes() of a merged tile: of a tile of `stored` segments in `bytes`, and the patch. Together, their
// positions may need more bits than apart: at most as many as the extent of `bounds`, the box of all samples. O(1).
std::uint64_t mergedBytesBound(std::uint64_t bytes, std::uint32_t stored, const Tile& patch, const GridBox& bounds);

}  // namespace filiform::internal
