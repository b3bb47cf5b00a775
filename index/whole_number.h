// Whole numbers in JSON that others wrote. The library's own conversion turns -5e20 into any integer and cuts 2^32 + 7
// to a 32-bit 7. Thread rule: pure.
#pragma once

#include <concepts>
#include <cstdint>
#include <stdexcept>
#include <utility>

namespace filiform {

// `json` is a value of nlohmann's library. Throws std::out_of_range where it is no number, has a fraction or an
// exponent, or does not fit.
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
