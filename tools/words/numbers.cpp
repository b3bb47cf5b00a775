#include "tools/words/numbers.h"

#include "index/errors.h"
#include "index/text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <system_error>

namespace filiform::tools {

std::uint64_t parseBytes(const std::string& option, const std::string& text) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  std::string unit(rest, end);
  unit.erase(0, unit.find_first_not_of(' ') == std::string::npos ? unit.size() : unit.find_first_not_of(' '));
  double factor = unit.empty() || unit == "B" ? 1 : 0;
  static constexpr std::string_view kPrefixes = "KMGT";
  if (const std::size_t prefix = kPrefixes.find(unit.empty()     ? ' '
                                                : unit[0] == 'k' ? 'K'
                                                                 : unit[0]);
      prefix != std::string_view::npos) {
    const std::string_view rest_of_unit = std::string_view(unit).substr(1);
    const bool binary = unit[0] != 'k' && (rest_of_unit == "iB" || rest_of_unit.empty());
    if (binary || rest_of_unit == "B") factor = std::pow(binary ? 1024.0 : 1000.0, static_cast<double>(prefix + 1));
  }
  if (error != std::errc() || factor == 0 || !(value >= 0) || value * factor > 9e18)
    throw UsageError(option + " " + inShort(text) +
                     ": give a number of bytes, or one with K, M, G, T (KiB, MiB, GiB, TiB) or KB, MB, GB, TB, such as "
                     "64MiB");
  return static_cast<std::uint64_t>(std::llround(value * factor));
}

std::string formatBytes(std::uint64_t bytes) {
  static constexpr std::array<const char*, 4> kUnits{"B", "KiB", "MiB", "GiB"};
  double value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 1024 && unit + 1 < kUnits.size()) value /= 1024, ++unit;
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), unit == 0 ? "%.0f %s" : "%.1f %s", value, kUnits[unit]);
  return text.data();
}

std::string formatNumber(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

double parseNumber(const std::string& what, const std::string& text) {
  double value = 0;
  const char* begin = text.data() + (text.size() > 1 && text[0] == '+' ? 1 : 0);
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value))
    throw UsageError(what + " is '" + inShort(text) + "': give a finite number");
  return value;
}

}  // namespace filiform::tools
