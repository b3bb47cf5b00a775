#include "viewer/scene/colour.h"

#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filiform {

namespace {

double cube(double x) { return x * x * x; }

}  // namespace

const char* toString(Theme theme) noexcept { return theme == Theme::light ? "light" : "dark"; }

Theme themeOf(const std::string& name) {
  for (const Theme theme : kThemes)
    if (name == toString(theme)) return theme;
  throw UsageError("--theme " + inShort(name) + ": choose light or dark");
}

Rgba lightnessChromaHue(double lightness, double chroma, double hue_rad) {
  const double a = chroma * std::cos(hue_rad), b = chroma * std::sin(hue_rad);
  const double l = cube(lightness + 0.3963377774 * a + 0.2158037573 * b);
  const double m = cube(lightness - 0.1055613458 * a - 0.0638541728 * b);
  const double s = cube(lightness - 0.0894841775 * a - 1.2914855480 * b);
  const auto channel = [](double linear) {
    const double c = std::clamp(linear, 0.0, 1.0);
    const double encoded = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::lround(255 * encoded));
  };
  return {channel(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          channel(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          channel(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s), 255};
}

Rgba colourOfNumber(std::uint64_t number) {
  const double turns = static_cast<double>(number) * (std::numbers::phi - 1);
  // The eye distinguishes about a dozen hues; three lightnesses triple that.
  return lightnessChromaHue(0.68 + 0.06 * static_cast<double>(number % 3), 0.13,
                            2 * std::numbers::pi * (turns - std::floor(turns)));
}

Rgba colourOfType(std::uint16_t type) {
  switch (type) {
    case 1:
      return {240, 240, 240};
    case 2:
      return {86, 180, 233};
    case 3:
      return {230, 159, 0};
    case 4:
      return {204, 121, 167};
    default:
      return {0, 158, 115};
  }
}

double radiusOnRamp(double radius_um) { return std::log10(radius_um / 0.05) / 2; }

Rgba colourOnRamp(double part) {
  if (std::isnan(part)) return {128, 128, 128};
  const double t = std::clamp(part, 0.0, 1.0);
  return lightnessChromaHue(0.45 + 0.45 * t, 0.13, (265 - 160 * t) * std::numbers::pi / 180);
}

}  // namespace filiform
