// The colours of cells in a file: --colour-table. Thread rule: functions without state.
#pragma once

#include "viewer/scene/cell_colours.h"

#include <memory>
#include <string>

namespace filiform {
class TileStore;
}

namespace filiform::tools {

// A line a cell: its name, a tab, and a colour, #rrggbb. A first line without a colour is a header. The last line
// of a cell counts. Other cells are grey. Names that the set does not have, and lines that have
// another form, are counted in one note. Throws IoError; UsageError if no line colours a cell. O(cells + lines).
std::shared_ptr<const CellColours> readColourTable(const TileStore& store, const std::string& path, Theme theme);

}  // namespace filiform::tools
