#include "index/cell/attribute.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace filiform {

namespace {

template <typename Number>
std::string shortest(Number value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

template <typename Number>
bool readsAll(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

// As attributeFrom(), also for a real with a decimal comma.
AttributeValue numberOrText(std::string_view field) {
  const std::size_t comma = field.find(',');
  if (comma == std::string_view::npos || field.find('.') != std::string_view::npos) return attributeFrom(field);
  std::string with_point(field);
  with_point[comma] = '.';
  AttributeValue value = attributeFrom(with_point);
  return std::holds_alternative<double>(value) ? value : AttributeValue(std::string(field));
}

// True for `1,234`, which may be 1234 or 1.234.
bool mayBeThousands(std::string_view field) {
  if (field.starts_with('-')) field.remove_prefix(1);
  const std::size_t comma = field.find(',');
  return comma >= 1 && comma <= 3 && field.size() == comma + 4 && field.front() != '0' &&
         field.find_first_not_of("0123456789", comma + 1) == std::string_view::npos;
}

}  // namespace

std::string_view name(AttributeType type) {
  static constexpr std::string_view kNames[] = {"text", "integer", "real"};
  return kNames[static_cast<std::size_t>(type)];
}

AttributeType typeOf(const AttributeValue& value) { return static_cast<AttributeType>(value.index() - 1); }

std::string textOf(const AttributeValue& value) {
  switch (value.index()) {
    case 1:
      return std::get<std::string>(value);
    case 2:
      return shortest(std::get<std::int64_t>(value));
    case 3:
      return shortest(std::get<double>(value));
    default:
      return {};
  }
}

std::optional<double> numberOf(const AttributeValue& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return static_cast<double>(*integer);
  if (const auto* real = std::get_if<double>(&value)) return *real;
  return std::nullopt;
}

bool isExactReal(std::int64_t integer) {
  const auto near = static_cast<double>(integer);
  return near < 9223372036854775808.0 && static_cast<std::int64_t>(near) == integer;
}

AttributeValue attributeFrom(std::string_view text) {
  if (text.empty()) return {};
  std::int64_t integer = 0;
  if (readsAll(text, integer) && shortest(integer) == text) return integer;
  const std::string_view digits = text.front() == '-' ? text.substr(1) : text;
  const bool leading_zero = digits.size() > 1 && digits[0] == '0' && digits[1] >= '0' && digits[1] <= '9';
  const bool looks_real = digits.find_first_of(".eE") != std::string_view::npos && !digits.empty() &&
                          (digits[0] == '.' || (digits[0] >= '0' && digits[0] <= '9'));
  double real = 0;
  if (looks_real && !leading_zero && readsAll(text, real) && std::isfinite(real)) return real;
  return std::string(text);
}

void FieldKinds::add(std::string_view field) {
  const AttributeValue value = numberOrText(field);
  any_text_ |= std::holds_alternative<std::string>(value);
  any_real_ |= std::holds_alternative<double>(value);
  if (const auto* const integer = std::get_if<std::int64_t>(&value)) any_long_ |= !isExactReal(*integer);
  if (!std::holds_alternative<double>(value)) return;
  const bool comma = field.find(',') != std::string_view::npos;
  any_comma_ |= comma;
  any_point_ |= field.find('.') != std::string_view::npos;
  any_decimal_comma_ |= comma && !mayBeThousands(field);
}

AttributeValue FieldKinds::valueOf(const std::string& field) const {
  return areText() && !field.empty() ? AttributeValue(field) : numberOrText(field);
}

std::optional<std::vector<AttributeValue>> exactNumbers(const std::vector<std::string>& texts) {
  constexpr std::int64_t kMostExact = std::int64_t{1} << 53;
  FieldKinds kinds;
  for (const std::string& text : texts) kinds.add(text);
  if (kinds.areText()) return std::nullopt;
  std::vector<AttributeValue> numbers;
  bool any = false;
  for (const std::string& text : texts) {
    AttributeValue value = kinds.valueOf(text);
    const auto* const integer = std::get_if<std::int64_t>(&value);
    if (integer != nullptr && (*integer > kMostExact || *integer < -kMostExact)) return std::nullopt;
    std::string back = textOf(value);
    if (text.find(',') != std::string::npos) std::replace(back.begin(), back.end(), '.', ',');
    if (back != text) return std::nullopt;
    any |= !text.empty();
    numbers.push_back(std::move(value));
  }
  return any ? std::optional(std::move(numbers)) : std::nullopt;
}

}  // namespace filiform
