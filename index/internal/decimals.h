// Numbers of exported cells as text.
#pragma once

#include "index/grid.h"

#include <charconv>

namespace filiform::internal {

// The fewest decimals whose text snaps to the same grid coordinate as `um`, which lies on the grid: a third of the
// digits of its exact value. Plain notation. Requires 40 bytes. Returns the text's end.
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

// The fewest digits that read back as the same float, whether as a double first or not. Requires a finite radius and 40
// bytes. Returns the text's end.
inline char* putRadius(char* at, float um) {
  constexpr std::ptrdiff_t kRoom = 40;
  char* const end = std::to_chars(at, at + kRoom, um).ptr;
  double read = 0;
  std::from_chars(at, end, read);
  if (static_cast<float>(read) == um) return end;
  return std::to_chars(at, at + kRoom, static_cast<double>(um)).ptr;
}

}  // namespace filiform::internal
