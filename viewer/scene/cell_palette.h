// The colours of a scene's neurites without their segments: a colour and a state for each cell. Another palette
// colours, dims and hides cells that are on the card already. Functions without state.
#pragma once

#include "viewer/scene/cell_colours.h"
#include "viewer/scene/neurite_batches.h"

#include <cstdint>
#include <vector>

namespace filiform {

// Dimmed cells recede towards the ground. Hidden ones are not drawn.
enum class CellState : std::uint8_t { hidden = 0, dimmed = 128, shown = 255 };
// By cell id. Cells beyond the list are shown.
using CellStates = std::vector<CellState>;

struct CellPalette {
  ColourBy colour = ColourBy::cell;
  double shallow_um = 0, deep_um = 1;  // ColourBy::depth: y of the ramp's two ends, in either order
  std::uint8_t hidden_types = 0;       // bit n: type n, 1 to 4; bit 0: all others
  std::vector<Rgba> of_cell;           // its alpha is the CellState; the colour is that of ColourBy::cell
};

// `colours`: replace `colour` and the cells' own colours; cells beyond them keep their own; nullptr: none. `states`:
// nullptr: all cells are shown. O(cells).
CellPalette makePalette(std::uint32_t cells, ColourBy colour, const CellColours* colours, const CellStates* states);

// The colour that a segment of a batch by cell is drawn with, before light and fog. Its alpha is the CellState. Cells
// beyond the palette have their own colours, and are shown.
Rgba paintedColour(const DrawnSegment& segment, const NeuriteBatch& batch, const CellPalette& palette);

}  // namespace filiform
