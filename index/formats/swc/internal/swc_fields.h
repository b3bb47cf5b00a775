// Splits an SWC line into columns and reads their numbers, without the locale. Thread rule: pure functions, any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace filiform::internal {

inline constexpr std::size_t kSwcColumns = 7;

inline bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

struct SwcFields {
  std::array<std::string_view, kSwcColumns> columns;
  std::size_t count = 0;
  bool extra_columns = false;
  bool separators = false;     // commas or semicolons stand between the columns
  bool decimal_comma = false;  // 0,5 or 1,234.5: the numbers are ambiguous; the other members are not set
};

// Splits a data line, not empty and without line end. A `#` in columns 1 to 6 belongs to the column (1.#IND); from
// column 7 on it starts a comment. O(length).
SwcFields splitFields(std::string_view line);

enum class IntegerKind : std::uint8_t {
  kInteger,   // 12
  kIntegral,  // 12.0, 1.2e1
  kBelow,     // an integer below -2^63
  kInvalid,   // a number, but fractional, above 2^63-1, or with an exponent and beyond 2^53
  kText       // not a number
};
// `value` is set for kInteger and kIntegral.
IntegerKind readInteger(std::string_view token, std::int64_t& value);

enum class RealKind : std::uint8_t { kFinite, kNonfinite, kText };
// NaN, infinities, NA, 1.#IND and overflow are kNonfinite; underflow is a finite 0. `value` is set for kFinite.
RealKind readReal(std::string_view token, double& value);

}  // namespace filiform::internal
