// Parses what a user types to go somewhere: a cell's name or a part of it, a place on a cell, or a point. Thread rule:
// pure functions; any thread that may read the set.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/places/cell_place_text.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct CellQuery {
  std::optional<Vector3d> p_W;           // "120 -40 800" or with commas: a point, um
  std::string name;                      // without a point: a cell
  std::optional<CellPlaceText> place{};  // on this cell; none: its soma
};
// Blanks at either end are ignored. The form of a place after the last colon: cell_place_text.h.
CellQuery parseCellQuery(const std::string& text);

struct CellMatches {
  std::size_t count = 0;             // number of cells that match
  std::vector<std::uint32_t> cells;  // the best matches
};
// Cells whose name (`by_source`: whose source) contains the text, ignoring letter case; at most `most`. Order: equal to
// the text, then equal apart from letter case, then those that begin with the text, then the others; each group in byte
// order of names. O(cells).
CellMatches matchCells(const TileStore& store, const std::string& text, bool by_source, std::size_t most);

// The best matches among names; if no name matches, among sources.
std::vector<std::uint32_t> findCells(const TileStore& store, const std::string& text, std::size_t most);

}  // namespace filiform
