// Numbers in the forms that nearly all lines of SWC have. Each function reads at `at`, moves it behind the number, and
// returns false for anything unusual. Functions without state. O(digits).
#pragma once

#include "index/formats/swc/internal/swc_fields.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace filiform::internal {

// Reads a number without a sign, of at most `max_digits` digits. Requires end - at <= 19.
inline bool plainInteger(const char*& at, const char* end, std::int64_t& value, int max_digits) {
  const char* const start = at;
  std::uint64_t sum = 0;  // at most 19 digits, by `end`
  while (at < end && *at >= '0' && *at <= '9') sum = sum * 10 + static_cast<std::uint64_t>(*at++ - '0');
  value = static_cast<std::int64_t>(sum);
  return at > start && at - start <= max_digits;
}

// Reads a finite number before a blank. One without an exponent and of at most 15 digits is a whole number over a power
// of ten. A double holds both exactly, so their quotient is the nearest double.
inline bool plainReal(const char*& at, const char* end, double& value) {
  constexpr std::ptrdiff_t kMostDigits = 15;
  static constexpr std::array<double, kMostDigits + 1> kPowers = {1,   1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                                  1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const char* p = at;
  const bool negative = p < end && *p == '-';
  p += negative;
  const char* const digits = p;
  std::uint64_t sum = 0;  // its overflow does not matter: such numbers have too many digits
  const auto readDigits = [&] {
    for (; p < end && *p >= '0' && *p <= '9'; ++p) sum = sum * 10 + static_cast<std::uint64_t>(*p - '0');
  };
  readDigits();
  const std::ptrdiff_t whole = p - digits;
  std::ptrdiff_t decimals = 0;
  if (p < end && *p == '.') {
    ++p;
    readDigits();
    decimals = p - digits - whole - 1;
  }
  if (whole + decimals > 0 && whole + decimals <= kMostDigits && p < end && isBlank(*p)) {
    const double magnitude =
        static_cast<double>(static_cast<std::int64_t>(sum)) / kPowers[static_cast<std::size_t>(decimals)];
    value = negative ? -magnitude : magnitude;
    at = p;
    return true;
  }
  const auto [stop, error] = std::from_chars(at, end, value);
  at = stop;
  return error == std::errc() && at < end && isBlank(*at) && std::isfinite(value);
}

}  // namespace filiform::internal
