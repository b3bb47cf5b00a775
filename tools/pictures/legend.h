// Draws the legend of colours. Function without state.
#pragma once

#include "tools/pictures/canvas.h"
#include "viewer/scene/camera.h"
#include "viewer/scene/cell_colours.h"

namespace filiform::tools {

// Of letters on the ground of a picture, and their height (px): of a capital.
Rgba inkOn(bool light);
double capitalOf(const PictureSize& size);

// At the upper left of a picture of this size: the attribute's name, then a coloured square, the value and the number
// of cells a line. Lines that do not fit the height are counted in the last line. Nothing for colours without a legend.
void drawLegend(Canvas& canvas, const PictureSize& size, const CellColours& colours, bool on_light);

}  // namespace filiform::tools
