// Colours of threads and of the viewer's aids. sRGB, 8 bits a channel. Pure functions.
#pragma once

#include <cstdint>

namespace filiform {

struct Rgba {
  std::uint8_t r = 255, g = 255, b = 255, a = 255;
  friend bool operator==(const Rgba&, const Rgba&) = default;
};

// Of that OKLab lightness (0..1), chroma (0..0.3) and hue, clipped to what a screen shows. (Ottosson, A perceptual
// colour space for image processing.)
Rgba lightnessChromaHue(double lightness, double chroma, double hue_rad);

// A cell's, a tile's: equally light, neighbouring numbers far apart in hue.
Rgba colourOfNumber(std::uint64_t number);
// An SWC type: soma, axon, basal and apical dendrite and all others, told apart by readers with any colour blindness
// (after Okabe and Ito).
Rgba colourOfType(std::uint16_t type);
// From dark blue (0) over green to light yellow (1), lightness growing evenly; NaN is grey.
Rgba colourOnRamp(double part);

}  // namespace filiform
