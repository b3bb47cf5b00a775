// What `cells --json` and the service state about a cell. Functions without state.
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>
#include <optional>

#include <nlohmann/json.hpp>

namespace filiform::tools {

// The number of independent loops: the links that the cell has beyond those of a forest.
std::uint64_t loopsOf(const CellRecord& cell);
// The fields of a row of `cells --json`; length_um is null without `length_um`.
nlohmann::ordered_json cellJson(std::uint32_t id, const CellRecord& cell, const Grid& grid,
                                const std::optional<double>& length_um = {});

}  // namespace filiform::tools
