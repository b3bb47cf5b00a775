// The glyph of a fork: its branches, with the proxy's own branch different from the others in colour and shape (the
// paper, section 4). Pure functions.
#pragma once

#include "solver/travel/places/junction.h"
#include "viewer/scene/neurite_batches.h"

namespace filiform {

struct GlyphPalette {
  Rgba own, other;
};
inline constexpr GlyphPalette kRedGreen{{235, 60, 50, 255}, {70, 200, 90, 255}};  // the paper's
inline constexpr GlyphPalette kOrangeBlue{{255, 150, 20, 255},
                                          {70, 150, 255, 255}};  // distinct with any colour blindness
// For red and cyan glasses, which darken red and hide hues: these colours differ in brightness.
inline constexpr GlyphPalette kForGlasses{{255, 240, 90, 255}, {50, 130, 255, 255}};

// Draws the branches as round cones. The proxy's own branch is a thick line with a filled head; the others are thin
// lines with a ring as head. Each branch has its own course, scaled to the length `length_um`. `line_um` is the
// thickness of a thin line.
NeuriteBatch glyphBatch(const Junction& junction, double length_um, double line_um,
                        const GlyphPalette& palette = kRedGreen);

}  // namespace filiform
