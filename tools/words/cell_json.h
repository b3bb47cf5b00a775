// What `cells --json` and the service state about a cell. Functions without state.
#pragma once

#include "index/cell/attribute.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::tools {

// The number of independent loops: the links that the cell has beyond those of a forest.
std::uint64_t loopsOf(const CellRecord& cell);
// An object: the attributes by name. Values are texts or numbers.
nlohmann::ordered_json attributesJson(const std::vector<CellAttribute>& attributes);
// The fields of a row of `cells --json`, without attributes; length_um is null without `length_um`.
nlohmann::ordered_json cellJson(std::uint32_t id, const CellRecord& cell, const Grid& grid,
                                const std::optional<double>& length_um = {});

}  // namespace filiform::tools
