// Colours of neurites and overlays. sRGB, 8 bits a channel. Pure functions.
#pragma once

#include "index/errors.h"

#include <cstdint>
#include <string>

namespace filiform {

struct Rgba {
  std::uint8_t r = 255, g = 255, b = 255, a = 255;
  friend bool operator==(const Rgba&, const Rgba&) = default;
};

// The four bytes as a number, red lowest.
constexpr std::uint32_t paintOf(const Rgba& c) {
  return c.r | std::uint32_t{c.g} << 8 | std::uint32_t{c.b} << 16 | std::uint32_t{c.a} << 24;
}
constexpr Rgba colourOfPaint(std::uint32_t paint) {
  const auto byte = [paint](int shift) { return static_cast<std::uint8_t>(paint >> shift); };
  return {byte(0), byte(8), byte(16), byte(24)};
}

// Of panels, and of the ground of pictures.
enum class Theme : std::uint8_t { dark, light };
inline constexpr Theme kThemes[] = {Theme::dark, Theme::light};
const char* toString(Theme theme) noexcept;
Theme themeOf(const std::string& name);  // throws UsageError that lists the choices
inline constexpr Rgba kDarkGround{13, 15, 20};
constexpr Rgba groundOf(Theme theme) { return theme == Theme::light ? Rgba{250, 250, 250} : kDarkGround; }

// The colour of this OKLab lightness (0..1), chroma (0..0.3) and hue, clipped to sRGB. (Ottosson, A perceptual colour
// space for image processing.)
Rgba lightnessChromaHue(double lightness, double chroma, double hue_rad);

// The colour of a cell or tile by its number: similar lightness, and neighbouring numbers differ much in hue.
Rgba colourOfNumber(std::uint64_t number);
// The colour of an SWC type: soma, axon, basal dendrite, apical dendrite, and one for all others. Readers with colour
// blindness can distinguish them (after Okabe and Ito).
Rgba colourOfType(std::uint16_t type);
// The part of the ramp for a radius: 0.05 to 5 um, the range of neurites, on a logarithmic scale.
double radiusOnRamp(double radius_um);
// From dark blue (0) over green to light yellow (1), with evenly growing lightness. NaN gives grey.
Rgba colourOnRamp(double part);

}  // namespace filiform
