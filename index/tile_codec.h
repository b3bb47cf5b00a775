// A tile as bytes. Two parts, read separately: geometry and topology (what the hand needs), and appearance (what the
// eye needs). FORMAT.md specifies every byte. Stateless: any thread may call.
#pragma once

#include "index/tile.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

// The bytes depend on the tile's segments only: forests, and graphs with loops, where a segment's rank is that of its
// link. Throws InputError when a position lies outside the grid. O(segments).
std::vector<std::uint8_t> encodeTile(const Tile& tile);
std::vector<std::uint8_t> encodeAppearance(const TileAppearance& appearance);

// The inverse. Whatever the bytes are, neither reads beyond them nor allocates more than a fixed multiple of their
// number. Throws CorruptTile with `file` and the position, counted from `offset`, when they cannot be. O(segments).
struct TilePlace {
  TileId tile;
  CellKey key;
  bool is_long;
  const char* file;
  std::uint64_t offset;  // of the bytes in the file
};
Tile decodeTile(std::span<const std::uint8_t> bytes, const TilePlace& place, const Grid& grid);
// `count` is the number of segments that the directory gives the tile.
TileAppearance decodeAppearance(std::span<const std::uint8_t> bytes, const TilePlace& place, std::uint32_t count);

}  // namespace filiform
