#include "index/cell/attribute_conditions.h"

#include "index/cell/glob.h"
#include "index/errors.h"
#include "index/text.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>
#include <variant>

namespace filiform {
namespace {

// The number that the whole text states, or NaN.
double numberOrNaN(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && !text.empty() ? value : std::nan("");
}

std::string withoutEndBlanks(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(' ');
  return begin == std::string::npos ? std::string() : text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

// The same as a number that also holds every 64-bit integer.
long double exactOrNaN(const std::string& text) {
  const AttributeValue value = attributeFrom(text);
  const auto* const integer = std::get_if<std::int64_t>(&value);
  return integer != nullptr ? static_cast<long double>(*integer) : numberOrNaN(text);
}
long double exactOf(const AttributeValue& value) {
  const auto* const integer = std::get_if<std::int64_t>(&value);
  return integer != nullptr ? static_cast<long double>(*integer) : numberOf(value).value_or(std::nan(""));
}

}  // namespace

AttributeConditions::AttributeConditions(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) {
    const std::size_t at = text.find_first_of("=<>!");
    Condition condition{withoutEndBlanks(text.substr(0, at)), "", "", text};
    if (at != std::string::npos) {
      const bool wide = at + 1 < text.size() && text[at + 1] == '=';
      condition.op = text.substr(at, wide ? 2 : 1);
      condition.value = withoutEndBlanks(text.substr(at + condition.op.size()));
      if (condition.op == "==") condition.op = "=";
    }
    if (condition.name.empty() || condition.op.empty() || condition.op == "!" ||
        condition.value.find_first_of("=<>!") == 0 || (condition.ofOrder() && std::isnan(numberOrNaN(condition.value))))
      throw UsageError("--where " + inShort(text) +
                       ": expected NAME=VALUE, NAME!=VALUE, or NAME<NUMBER with <, <=, > or >=; a VALUE that begins "
                       "with = < > or ! needs \\ before it");
    all_.push_back(std::move(condition));
  }
}

bool AttributeConditions::Condition::meets(const AttributeValue& found) const {
  const long double number = exactOf(found), limit = exactOrNaN(value);  // NaN compares false
  if (op == "<") return number < limit;
  if (op == "<=") return number <= limit;
  if (op == ">") return number > limit;
  if (op == ">=") return number >= limit;
  const bool equal =
      isMissing(found) ? value.empty() : textOf(found) == value || matchesGlob(value, textOf(found)) || number == limit;
  return equal == (op == "=");
}

void AttributeConditions::Condition::refuseText() const {
  throw UsageError("--where " + inShort(whole) + ": " + escaped(name, 80) + " holds text, so only = and != apply");
}

void AttributeConditions::Condition::refuseName(const std::string& what) const {
  throw UsageError("--where " + inShort(whole) + ": " + what);
}

}  // namespace filiform
