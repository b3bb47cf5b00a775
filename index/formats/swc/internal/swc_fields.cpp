#include "index/formats/swc/internal/swc_fields.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

namespace filiform::internal {
namespace {

constexpr std::size_t kCommentColumn = kSwcColumns - 1;

bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isSeparator(char c) { return c == ',' || c == ';'; }

std::size_t skipDigits(std::string_view text, std::size_t at) {
  while (at < text.size() && isDigit(text[at])) ++at;
  return at;
}

// Splits at runs of blanks, and at each character for which `alone` holds. Columns between two of the latter may be
// empty.
template <class Alone>
SwcFields split(std::string_view line, Alone alone) {
  SwcFields fields;
  std::size_t at = 0;
  const auto skip_blanks = [&] {
    while (at < line.size() && isBlank(line[at])) ++at;
  };
  skip_blanks();
  while (at < line.size()) {
    const std::size_t start = at;
    if (fields.count >= kCommentColumn && line[at] == '#') break;
    if (fields.count == kSwcColumns) {
      fields.extra_columns = true;
      break;
    }
    while (at < line.size() && !isBlank(line[at]) && !alone(line[at])) {
      if (fields.count == kCommentColumn && line[at] == '#') break;
      ++at;
    }
    fields.columns[fields.count++] = line.substr(start, at - start);
    skip_blanks();
    // A separator at the end of the line closes the last column and opens no new one.
    if (at < line.size() && alone(line[at])) {
      ++at;
      skip_blanks();
    }
  }
  return fields;
}

// True for 0,5 or -12,25e3, thousands as 1,234 or 1,234,567.8, or 1.234,5. A comma at either end is a separator.
bool isDecimalComma(std::string_view token) {
  while (!token.empty() && token.front() == ',') token.remove_prefix(1);
  while (!token.empty() && token.back() == ',') token.remove_suffix(1);
  const std::size_t commas = static_cast<std::size_t>(std::count(token.begin(), token.end(), ','));
  if (commas == 0) return false;
  if (token.find_first_not_of("0123456789.,+-eE") != std::string_view::npos) return false;
  const std::size_t first = token.find(',');
  if (!isDigit(token[first - 1]) || !isDigit(token[first + 1])) return false;
  if (commas == 1) return true;
  for (std::size_t comma = first; comma != std::string_view::npos; comma = token.find(',', comma + 1)) {
    if (skipDigits(token, comma + 1) != comma + 4) return false;
  }
  return true;
}

std::string_view withoutPlus(std::string_view token) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-' && token[1] != '+') token.remove_prefix(1);
  return token;
}

bool equalsNoCase(std::string_view token, std::string_view lower) {
  return token.size() == lower.size() && std::equal(token.begin(), token.end(), lower.begin(), [](char a, char b) {
           return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
         });
}

// True for words that mean "no number": R's NA, and the output of old Microsoft C libraries (1.#IND, -1.#INF00,
// 1.#QNAN).
bool isNonfiniteWord(std::string_view token) {
  if (!token.empty() && (token[0] == '-' || token[0] == '+')) token.remove_prefix(1);
  if (equalsNoCase(token, "na")) return true;
  if (token.substr(0, 3) != "1.#") return false;
  token.remove_prefix(3);
  for (const std::string_view word : {"ind", "inf", "qnan", "snan"}) {
    if (equalsNoCase(token.substr(0, word.size()), word) && skipDigits(token, word.size()) == token.size()) return true;
  }
  return false;
}

// True if a significant digit stands left of the point. std::from_chars reports "out of range" for both overflow and
// underflow.
bool isAboveOne(std::string_view number) {
  const std::size_t exponent_at = std::min(number.find_first_of("eE"), number.size());
  const std::string_view mantissa = number.substr(0, exponent_at);
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  const std::size_t leading = mantissa.find_first_of("123456789");
  if (leading == std::string_view::npos) return false;
  const double magnitude =
      leading < point ? static_cast<double>(point - leading) : -static_cast<double>(leading - point);
  double exponent = 0;
  if (exponent_at < number.size()) {
    std::string_view digits = withoutPlus(number.substr(exponent_at + 1));
    const bool negative = !digits.empty() && digits[0] == '-';
    if (negative) digits.remove_prefix(1);
    for (const char c : digits) exponent = std::min(exponent * 10 + (c - '0'), 1e18);
    if (negative) exponent = -exponent;
  }
  return magnitude + exponent > 0;
}

}  // namespace

SwcFields splitFields(std::string_view line) {
  SwcFields fields = split(line, [](char) { return false; });
  const auto has_separator = [](std::string_view column) {
    return std::any_of(column.begin(), column.end(), isSeparator);
  };
  const auto end = fields.columns.begin() + static_cast<std::ptrdiff_t>(fields.count);
  if (std::none_of(fields.columns.begin(), end, has_separator)) return fields;

  // Commas inside columns already separated by blanks or semicolons (seven columns) are part of the numbers.
  SwcFields coarse = split(line, [](char c) { return c == ';'; });
  const auto coarse_end = coarse.columns.begin() + static_cast<std::ptrdiff_t>(coarse.count);
  const bool comment_inside = std::any_of(coarse.columns.begin(), coarse_end,
                                          [](std::string_view column) { return !column.empty() && column[0] == '#'; });
  if (coarse.count == kSwcColumns && !comment_inside &&
      std::any_of(coarse.columns.begin(), coarse_end, isDecimalComma)) {
    coarse.decimal_comma = true;
    return coarse;
  }
  fields = split(line, isSeparator);
  fields.separators = true;
  return fields;
}

IntegerKind readInteger(std::string_view token, std::int64_t& value) {
  std::string_view digits = withoutPlus(token);
  const bool negative = !digits.empty() && digits[0] == '-';
  if (negative) digits.remove_prefix(1);

  const std::size_t whole = skipDigits(digits, 0);
  std::size_t at = whole;
  std::string_view fraction;
  if (at < digits.size() && digits[at] == '.') {
    const std::size_t end = skipDigits(digits, at + 1);
    fraction = digits.substr(at + 1, end - at - 1);
    at = end;
  }
  if (whole == 0 && fraction.empty()) return IntegerKind::kText;

  if (at == digits.size()) {
    if (fraction.find_first_not_of('0') != std::string_view::npos) return IntegerKind::kInvalid;
    const IntegerKind kind = whole == digits.size() ? IntegerKind::kInteger : IntegerKind::kIntegral;
    const std::string_view integer = digits.substr(0, whole);
    std::uint64_t magnitude = 0;
    if (!integer.empty()) {
      const auto [end, error] = std::from_chars(integer.data(), integer.data() + integer.size(), magnitude);
      if (error != std::errc() || magnitude > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
        return negative ? IntegerKind::kBelow : IntegerKind::kInvalid;
      }
    }
    value = negative ? -static_cast<std::int64_t>(magnitude) : static_cast<std::int64_t>(magnitude);
    return kind;
  }

  double real = 0;
  switch (readReal(token, real)) {
    case RealKind::kText:
      return IntegerKind::kText;
    case RealKind::kNonfinite:
      return IntegerKind::kInvalid;
    case RealKind::kFinite:
      break;
  }
  constexpr double kExact = 9007199254740992.0;  // 2^53
  const bool underflow = real == 0 && digits.substr(0, at).find_first_of("123456789") != std::string_view::npos;
  if (std::abs(real) > kExact || std::floor(real) != real || underflow) return IntegerKind::kInvalid;
  value = static_cast<std::int64_t>(real);
  return IntegerKind::kIntegral;
}

RealKind readReal(std::string_view token, double& value) {
  const std::string_view number = withoutPlus(token);
  double parsed = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), parsed);
  if (error == std::errc::invalid_argument || end != number.data() + number.size()) {
    return isNonfiniteWord(token) ? RealKind::kNonfinite : RealKind::kText;
  }
  if (error == std::errc::result_out_of_range) {
    if (isAboveOne(number)) return RealKind::kNonfinite;
    value = 0;
    return RealKind::kFinite;
  }
  if (!std::isfinite(parsed)) return RealKind::kNonfinite;
  value = parsed;
  return RealKind::kFinite;
}

}  // namespace filiform::internal
