// A palette of cells on the graphics card: a ramp, colours of types, and the cells' colours and states, as one texture.
// Thread rule: the thread of the context.
#pragma once

#include "viewer/gl/internal/card_batch.h"
#include "viewer/gl/internal/gl_objects.h"
#include "viewer/scene/cell_palette.h"

#include <epoxy/gl.h>

namespace filiform::internal {

class CardPalette {
 public:
  CardPalette() = default;
  CardPalette(const CardPalette&) = delete;
  CardPalette& operator=(const CardPalette&) = delete;
  ~CardPalette() { glDeleteTextures(1, &texture_); }

  // Cells beyond the card's largest texture, some millions, and beyond the palette share colours and states. O(cells).
  void put(const CellPalette& palette);
  // For a shader that is used: once before drawing; and before each batch.
  void bind(Program& program, double receding) const;
  void paint(Program& program, const CardBatch& batch) const;

 private:
  GLuint texture_ = 0;
  int cells_ = 0;
  ColourBy colour_ = ColourBy::cell;
  int hidden_types_ = 0;
  double shallow_um_ = 0, deep_um_ = 1;
};

}  // namespace filiform::internal
