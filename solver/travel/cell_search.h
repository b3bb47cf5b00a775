// What a person types to get somewhere: a cell's name or a part of it, CELL:SAMPLE, or a point. Pure functions; any
// thread that may load.
#pragma once

#include "index/set/tile_store.h"

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

struct CellMatches {
  std::size_t count = 0;             // all that match
  std::vector<std::uint32_t> cells;  // the best of them
};
// Cells whose name, or source where `by_source`, has the text in it, in any letter case: the very text first, then
// those that begin with it, then the others, each in byte order of names; at most `most`. O(cells).
CellMatches matchCells(const TileStore& store, const std::string& text, bool by_source, std::size_t most);

// The best matches of names, or, where no name matches, of sources.
std::vector<std::uint32_t> findCells(const TileStore& store, const std::string& text, std::size_t most);

}  // namespace filiform
