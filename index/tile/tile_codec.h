// Encodes a tile to bytes and decodes it. A tile has two parts that are read separately: geometry and topology (for
// haptics) and appearance (for drawing). FORMAT.md specifies every byte. Thread rule: functions without state.
#pragma once

#include "index/tile/tile.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

// Encode both parts. The bytes depend only on the tile's segments. In a graph with loops, a segment's rank is the rank
// of its link. Throws InputError if a position lies outside the grid. O(segments).
std::vector<std::uint8_t> encodeTile(const Tile& tile);
std::vector<std::uint8_t> encodeAppearance(const TileAppearance& appearance);

// Where the bytes of a tile lie. Errors name `file` and a position counted from `offset`.
struct TilePlace {
  TileId tile;
  BlockKey key;
  bool is_long;
  const char* file;
  std::uint64_t offset;  // of the bytes in the file
};
// Decode both parts. For any input, they read only the given bytes and allocate at most a fixed multiple of their
// number. Throw CorruptTile for bytes that no encoder wrote. O(segments).
Tile decodeTile(std::span<const std::uint8_t> bytes, const TilePlace& place, const Grid& grid);
// `count` is the number of segments that the directory states for the tile.
TileAppearance decodeAppearance(std::span<const std::uint8_t> bytes, const TilePlace& place, std::uint32_t count);

}  // namespace filiform
