// How the branches at a junction are drawn: the proxy's own is told apart from the others by colour and by shape (the
// paper, 4). Pure functions.
#pragma once

#include "solver/travel/junction.h"
#include "viewer/scene/neurite_batches.h"

namespace filiform {

struct GlyphPalette {
  Rgba own, other;
};
inline constexpr GlyphPalette kRedGreen{{235, 60, 50, 255}, {70, 200, 90, 255}};      // the paper's
inline constexpr GlyphPalette kOrangeBlue{{255, 150, 20, 255}, {70, 150, 255, 255}};  // told apart by all readers
// Through red and cyan glasses a red is dark and hues are next to lost: these differ by brightness.
inline constexpr GlyphPalette kForGlasses{{255, 240, 90, 255}, {50, 130, 255, 255}};

// Round cones about the junction at the origin: the proxy's own branch is a thick line with a filled head, the others
// are thin with a ring for a head. Every branch is drawn `length_um` long, in the direction and with the course that it
// has, stretched if it is shorter. `line_um` is the thickness of a thin line.
NeuriteBatch glyphBatch(const Junction& junction, double length_um, double line_um,
                        const GlyphPalette& palette = kRedGreen);

}  // namespace filiform
