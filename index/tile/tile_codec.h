// Encodes a tile to bytes and decodes it. A stored tile has two parts that are read separately: a Tile (geometry and
// topology, for haptics) and a TileAppearance (radii and types, for drawing). FORMAT.md specifies every byte. Thread
// rule: functions without state.
#pragma once

#include "index/tile/tile.h"
#include "index/tile/tile_place.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

// Encodes a tile. The bytes depend only on its segments. Throws InputError if a position lies outside the grid.
// O(segments).
std::vector<std::uint8_t> encodeTile(const Tile& tile);
// Encodes an appearance. O(segments).
std::vector<std::uint8_t> encodeAppearance(const TileAppearance& appearance);

// Decodes a tile. `grid` must be that of the set. Whatever the bytes are, both decoders read only these bytes and
// allocate at most a fixed multiple of their number. They throw CorruptTile if the bytes are not a whole encoding, or
// continue after it. Checksums are the caller's. O(segments).
Tile decodeTile(std::span<const std::uint8_t> bytes, const TilePlace& place, const Grid& grid);
// Decodes an appearance. `count`: the segments that the tile owns; other numbers are CorruptTile.
TileAppearance decodeAppearance(std::span<const std::uint8_t> bytes, const TilePlace& place, std::uint32_t count);

}  // namespace filiform
