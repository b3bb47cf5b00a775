// Writes a cell as it was read, without a tile set between: positions are not rounded to a grid.
#pragma once

#include "index/cell/cell.h"

#include <iosfwd>

namespace filiform {

// The header, then a line a sample: every number in the fewest digits that read back as the same number. Positions and
// radii are in um. Reading the text gives the same cell, so writing that cell gives the same bytes. Requires a forest
// without block_starts, and known radii. Write errors set the stream's state. O(samples). Pure function.
void writeCleanSwc(std::ostream& out, const Cell& cell);

}  // namespace filiform
