// Reads whole numbers from JSON of other programs. The JSON library's own conversion turns -5e20 into an arbitrary
// integer and truncates 2^32 + 7 to a 32-bit 7. Thread rule: pure function.
#pragma once

#include <concepts>
#include <cstdint>
#include <stdexcept>
#include <utility>

namespace filiform {

// Converts `json`, a value of nlohmann's library, to a T. Throws std::out_of_range if it is not a number, has a
// fraction or an exponent, or does not fit.
template <std::integral T, typename Json>
T wholeNumber(const Json& json) {
  if (json.is_number_unsigned()) {
    if (const auto number = json.template get<std::uint64_t>(); std::in_range<T>(number)) return static_cast<T>(number);
  } else if (json.is_number_integer()) {
    if (const auto number = json.template get<std::int64_t>(); std::in_range<T>(number)) return static_cast<T>(number);
  }
  throw std::out_of_range("no whole number in its range");
}

}  // namespace filiform
