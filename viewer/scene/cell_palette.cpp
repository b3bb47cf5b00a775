#include "viewer/scene/cell_palette.h"

namespace filiform {

CellPalette makePalette(std::uint32_t cells, ColourBy colour, const CellColours* colours, const CellStates* states) {
  CellPalette palette{.colour = colours != nullptr ? ColourBy::cell : colour, .of_cell = {}};
  palette.of_cell.reserve(cells);
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    Rgba own = colours != nullptr && cell < colours->of_cell.size() ? colours->of_cell[cell]
               : palette.colour == ColourBy::cell                   ? colourOfNumber(cell)
                                                                    : Rgba();
    own.a = static_cast<std::uint8_t>(states != nullptr && cell < states->size() ? (*states)[cell] : CellState::shown);
    palette.of_cell.push_back(own);
  }
  return palette;
}

Rgba paintedColour(const DrawnSegment& segment, const NeuriteBatch& batch, const CellPalette& palette) {
  const std::uint32_t cell = cellOfPaint(segment.paint);
  const Rgba own = cell < palette.of_cell.size() ? palette.of_cell[cell] : colourOfNumber(cell);
  const auto in = [&own](Rgba colour) { return Rgba{colour.r, colour.g, colour.b, own.a}; };
  switch (palette.colour) {
    case ColourBy::cell:
      break;
    case ColourBy::type:
      return in(colourOfType(typeOfPaint(segment.paint)));
    case ColourBy::depth:
      return in(colourOnRamp((batch.origin_W.y() + segment.a_um[1] - palette.shallow_um) /
                             (palette.deep_um - palette.shallow_um)));
    case ColourBy::radius:
      return in(colourOnRamp(radiusOnRamp(segment.a_radius_um)));
    case ColourBy::tile:
      return in(colourOfNumber(batch.tile));
  }
  return own;
}

}  // namespace filiform
