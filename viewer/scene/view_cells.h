// The cells of a view in a tile set: their states, and those that the view names. Thread rule: a function without
// state.
#pragma once

#include "index/set/tile_store.h"
#include "viewer/scene/cell_palette.h"
#include "viewer/scene/view_state.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform {

struct ViewCells {
  CellStates states;                               // of all cells of the set
  std::vector<std::uint32_t> chosen, highlighted;  // ascending
  std::string note;  // a line that counts the names that the set does not have; empty: it has all
};

// If the set has no cell that the view shows alone, all but the hidden cells are shown. Throws what the store throws.
// O(cells + names log cells).
ViewCells viewCellsOf(const ViewState& view, const TileStore& store);

}  // namespace filiform
