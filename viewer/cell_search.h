// What a person types to get somewhere: a cell's name or a part of it, CELL:SAMPLE, or a point. Pure functions; any
// thread that may load.
#pragma once

#include "index/tile_store.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct CellQuery {
  std::optional<Vector3d> p_W;           // "120 -40 800" or with commas: a point, um
  std::string name;                      // else a cell
  std::optional<std::int64_t> sample{};  // and one of its samples
};
// Blanks around it do not count. A number after the last colon is a sample.
CellQuery parseCellQuery(const std::string& text);

// Cells whose name has the text in it, in any letter case: the very name first, then names that begin with it, then the
// others, each in byte order; at most `most`. O(cells).
std::vector<std::uint32_t> findCells(const TileStore& store, const std::string& text, std::size_t most);

}  // namespace filiform
