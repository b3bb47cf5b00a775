// Draws the legend of colours by an attribute into a picture. Function without state.
#pragma once

#include "viewer/gl/renderer.h"
#include "viewer/scene/cell_colours.h"

namespace filiform::tools {

// At the upper left: the attribute's name, then a coloured square, the value and the number of cells a line. Lines that
// do not fit the height are counted in the last line. Nothing for colours without a legend.
void drawLegend(Picture& picture, const CellColours& colours);

}  // namespace filiform::tools
