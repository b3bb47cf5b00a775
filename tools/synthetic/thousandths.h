// Numbers with three decimals as text, from exact integers. Functions without state.
#pragma once

#include <charconv>
#include <cstdint>
#include <string>

namespace filiform::tools {

inline void appendInteger(std::string& out, std::uint64_t value) {
  char digits[20];
  out.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

// 12345 -> "12.345".
inline void appendThousandths(std::string& out, std::int64_t value) {
  if (value < 0) out += '-';
  const std::uint64_t magnitude = value < 0 ? 0 - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
  appendInteger(out, magnitude / 1000);
  const auto rest = static_cast<int>(magnitude % 1000);
  const char decimals[4] = {'.', static_cast<char>('0' + rest / 100), static_cast<char>('0' + rest / 10 % 10),
                            static_cast<char>('0' + rest % 10)};
  out.append(decimals, 4);
}

}  // namespace filiform::tools
