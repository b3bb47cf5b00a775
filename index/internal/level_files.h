// levels.bin: where the tiles of the levels of detail lie, and what each of them is. FORMAT.md describes the same bytes
// for people. Decoders throw Damage and never read beyond what they are given.
#pragma once

#include "index/internal/set_files.h"
#include "index/levels.h"

#include <string>
#include <vector>

namespace filiform::internal {

inline constexpr const char* kLevelsFile = "levels.bin";
std::string levelPackFile(std::uint32_t pack);
Bytes levelPackHeader(std::uint32_t pack);

struct LevelTable {
  Grid grid;
  std::uint32_t most_segments = 0;  // aimed at, a tile
  std::vector<LevelEntry> entries;  // ascending by lowest key, a cell before those inside it
  std::vector<TileLocation> locations;
};
Bytes encodeLevels(const LevelTable& table);
LevelTable decodeLevels(ByteSpan bytes);

}  // namespace filiform::internal
