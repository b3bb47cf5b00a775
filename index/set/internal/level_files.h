// Encodes and decodes levels.bin: position and description of every level tile. FORMAT.md specifies the bytes. Decoders
// throw Damage and never read past their input.
#pragma once

#include "index/set/internal/set_files.h"
#include "index/set/levels.h"

#include <string>
#include <vector>

namespace filiform::internal {

inline constexpr const char* kLevelsFile = "levels.bin";
std::string levelPackFile(std::uint32_t pack);
Bytes levelPackHeader(std::uint32_t pack);

struct LevelTable {
  Grid grid;
  std::uint32_t most_segments = 0;  // limit of a tile
  std::vector<LevelEntry> entries;  // ascending by lowest key, a block before the blocks inside it
  std::vector<TileLocation> locations;
};
Bytes encodeLevels(const LevelTable& table);
LevelTable decodeLevels(ByteSpan bytes);

}  // namespace filiform::internal
