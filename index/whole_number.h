// Reads whole numbers from JSON that other programs wrote, and checks their range. The JSON library's get<T>() does
// not: -5e20 becomes an arbitrary integer, and 2^32 + 7 becomes 7 in 32 bits. Thread rule: pure function.
#pragma once

#include <concepts>
#include <cstdint>
#include <stdexcept>
#include <utility>

namespace filiform {

// Converts `json`, a value of nlohmann's library, to a T: an integer type other than bool and characters. Throws
// std::out_of_range if `json` is not written as an integer (3.0 and 1e3 are refused) or does not fit a T. The message
// does not name the field; the caller adds it.
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
