// Reference pictures of tests, and a measure of whether another picture shows the same.
#pragma once

#include "viewer/gl/renderer.h"

#include <string>

namespace filiform::test {

// The difference of two pictures after averaging each over 3 x 3 pixels. An edge that another driver rounds to the
// neighbouring pixel then counts little.
struct PictureDifference {
  bool same_size = true;
  double mean = 0;     // over all channels, 0..255
  double far_off = 0;  // fraction of the pixels in which a channel differs by more than kFarOff
  static constexpr int kFarOff = 24;

  // Allows for differences between drivers, but not for a neurite elsewhere or another colour.
  bool showsTheSame() const { return same_size && mean <= 1.5 && far_off <= 0.004; }
};
PictureDifference compare(const Picture& a, const Picture& b);

// The colour of a pixel. Requires a place inside.
inline Rgba colourAt(const Picture& picture, int x, int y) {
  const std::uint8_t* const c = &picture.rgb[static_cast<std::size_t>(3 * (y * picture.width + x))];
  return {c[0], c[1], c[2]};
}

// Throws std::runtime_error.
Picture readPng(const std::string& path);

}  // namespace filiform::test
