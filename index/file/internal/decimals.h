// Writes the numbers of exported cells as text.
#pragma once

#include "index/geometry/grid.h"

#include <charconv>

namespace filiform::internal {

// Writes the fewest decimals that snap to the same grid coordinate as `um`: a third of the digits of the exact value.
// `um` must lie on the grid. Plain notation. Requires 40 bytes. Returns the end of the text.
inline char* putCoordinate(char* at, double um, const Grid& grid) {
  constexpr std::ptrdiff_t kRoom = 40;
  const auto snapped = [&](double value) { return std::llround(std::ldexp(value, -grid.exponent())); };
  for (int decimals = 0;; ++decimals) {
    char* const end = std::to_chars(at, at + kRoom, um, std::chars_format::fixed, decimals).ptr;
    double read = 0;
    std::from_chars(at, end, read);
    if (snapped(read) == snapped(um)) return end;
  }
}

// Writes the fewest digits that read back as the same float, also when read through a double. Requires a finite radius
// and 40 bytes. Returns the end of the text.
inline char* putRadius(char* at, float um) {
  constexpr std::ptrdiff_t kRoom = 40;
  char* const end = std::to_chars(at, at + kRoom, um).ptr;
  double read = 0;
  std::from_chars(at, end, read);
  if (static_cast<float>(read) == um) return end;
  return std::to_chars(at, at + kRoom, static_cast<double>(um)).ptr;
}

// As putRadius(), for a 64-bit radius.
inline char* putRadius(char* at, double um) { return std::to_chars(at, at + 40, um).ptr; }

}  // namespace filiform::internal
