// The cell to travel if the user names none. Thread rule: function without state.
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>

namespace filiform {

// The cell with the most segments; ties: the first by name. Throws UsageError for a set without cells. O(cells).
std::uint32_t defaultCell(const TileStore& store);

}  // namespace filiform
