#include "index/cell/radius.h"

#include <array>
#include <bit>
#include <cfloat>
#include <charconv>
#include <cmath>
#include <limits>

namespace filiform {

float storedRadius(double radius_um) {
  const float narrow = static_cast<float>(radius_um);
  return narrow == 0 && radius_um > 0 ? std::numeric_limits<float>::denorm_min() : narrow;
}

bool isOddRadius(double radius_um) {
  constexpr std::int64_t kUlps = 8;
  const float stored = storedRadius(radius_um);
  if (!(radius_um > 0) || !std::isfinite(stored)) return false;
  std::array<char, 40> text;
  const char* const end = std::to_chars(text.data(), text.data() + text.size(), stored).ptr;
  double back = 0;
  std::from_chars(text.data(), end, back);
  const std::int64_t difference = std::bit_cast<std::int64_t>(back) - std::bit_cast<std::int64_t>(radius_um);
  return difference < -kUlps || difference > kUlps;
}

// A float keeps every decimal of FLT_DIG digits in its normal range, which a number without exponent cannot leave in so
// few digits.
bool mayBeOdd(std::string_view token) {
  int digits = 0, zeros = 0;  // significant digits up to the last that is not 0; zeros after them
  for (const char c : token) {
    if (c == 'e' || c == 'E') return true;
    if (c < '0' || c > '9' || (c == '0' && digits == 0)) continue;
    ++zeros;
    if (c == '0') continue;
    digits += zeros;
    zeros = 0;
  }
  return digits > FLT_DIG || token.size() > 30;
}

}  // namespace filiform
