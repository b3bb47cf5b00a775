// Encodes and decodes levels.bin: position and description of every level tile. FORMAT.md specifies the bytes. Decoders
// throw Damage and never read past their input.
#pragma once

#include "index/file/internal/set_files.h"
#include "index/levels/level_parts.h"

#include <string>
#include <vector>

namespace filiform::internal {

inline constexpr const char* kLevelsFile = "levels.bin";
std::string levelPackFile(std::uint32_t pack);
Bytes levelPackHeader(std::uint32_t pack);

// Ascending by lowest key; a block before the blocks inside it; of one block the coarsest tile first.
bool comesBefore(const LevelEntry& a, const LevelEntry& b);

struct LevelTable {
  Grid grid;
  std::uint32_t least_segments = 0;  // in full resolution below a tile, except the outermost
  std::vector<LevelEntry> entries;   // each comesBefore() the next
  std::vector<TileLocation> locations;
};
Bytes encodeLevels(const LevelTable& table);
LevelTable decodeLevels(ByteSpan bytes);

}  // namespace filiform::internal
