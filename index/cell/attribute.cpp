#include "index/cell/attribute.h"

#include <array>
#include <charconv>
#include <cmath>

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
  const AttributeValue value = attributeFrom(field);
  any_text_ |= std::holds_alternative<std::string>(value);
  any_real_ |= std::holds_alternative<double>(value);
  if (const auto* const integer = std::get_if<std::int64_t>(&value)) any_long_ |= !isExactReal(*integer);
}

AttributeValue FieldKinds::valueOf(const std::string& field) const {
  return areText() && !field.empty() ? AttributeValue(field) : attributeFrom(field);
}

}  // namespace filiform
