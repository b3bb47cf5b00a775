// Finds the cell that the user names.
#pragma once

#include <cstdint>
#include <string>

namespace filiform {
class TileStore;
}

namespace filiform::tools {

// Returns the cell whose name is `name`; else the only cell whose name contains `name`; else the only cell whose source
// contains it. The last two ignore letter case. Throws UsageError, which names `option` (where the text was given), and
// up to five matching cells or up to three cells with near names. O(log cells) for a whole name, else O(cells).
std::uint32_t findCellNamed(const TileStore& store, const std::string& name, const std::string& option = "--cell");

}  // namespace filiform::tools
