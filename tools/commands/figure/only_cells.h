// Some cells of a set as a scene: --only. Thread rule: functions without state.
#pragma once

#include "index/set/tile_set.h"
#include "viewer/scene/cell_colours.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

// The cells that any of the words names, ascending: NAME; ATTRIBUTE=VALUE and the other conditions of --where; @FILE
// with a name a line. Names in a file that the set does not have are counted in a note. Throws UsageError, with near
// names, for a word that fits no cell; IoError; what the set throws. Measures cells on all cores if a condition needs
// it.
std::vector<std::uint32_t> onlyCells(const TileSet& set, const std::vector<std::string>& words);

// A scene in memory, and the id in the set of each of its cells.
struct SomeCells {
  std::unique_ptr<TileStore> scene;
  std::vector<std::uint32_t> cells;
};
// Throws UsageError beyond kMostOnlySegments; what the set throws. O(segments of the tiles that the cells lie in).
inline constexpr std::uint64_t kMostOnlySegments = 5'000'000;
SomeCells sceneOfCells(const TileSet& set, const std::vector<std::uint32_t>& cells);

// The colours for that scene. `colours`: of the set; null gives each cell the colour that it has in the set.
std::shared_ptr<const CellColours> coloursOfCells(const CellColours* colours, const std::vector<std::uint32_t>& cells);

}  // namespace filiform::tools
