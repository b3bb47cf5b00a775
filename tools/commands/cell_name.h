// The cell that a person names.
#pragma once

#include <cstdint>
#include <string>

namespace filiform {
class TileStore;
}

namespace filiform::tools {

// The cell of that name, or the only one whose name, else the only one whose source, has this text in it, in any letter
// case. Throws UsageError naming `option` (where the text was given) and up to five cells that the text fits, or up to
// three whose names are near. O(log cells) for a whole name, else O(cells).
std::uint32_t findCellNamed(const TileStore& store, const std::string& name, const std::string& option = "--cell");

}  // namespace filiform::tools
