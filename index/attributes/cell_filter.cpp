#include "index/attributes/cell_filter.h"

#include "index/errors.h"
#include "index/set/glob.h"
#include "index/text.h"

#include <charconv>
#include <cmath>
#include <cstdint>
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

bool matches(const std::string& pattern, const std::string& text) {
  return pattern == text || matchesGlob(pattern, text);
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

bool compares(long double value, const std::string& op, long double limit) {
  if (op == "<") return value < limit;
  if (op == "<=") return value <= limit;
  if (op == ">") return value > limit;
  return value >= limit;
}

}  // namespace

std::string unknownAttribute(const std::string& name, const CellAttributes& attributes) {
  if (attributes.empty()) return "the set has no attributes of cells, so none named " + escaped(name, 80);
  std::string all;
  for (const CellAttributes::Column& column : attributes.columns())
    all += (all.empty() ? "" : ", ") + escaped(column.name, 80);
  return "the cells have no attribute " + escaped(name, 80) + "; the attributes are " + escaped(all, 600);
}

CellFilter::CellFilter(const std::vector<std::string>& conditions) {
  for (const std::string& text : conditions) {
    const std::size_t at = text.find_first_of("=<>!");
    Condition condition{withoutEndBlanks(text.substr(0, at)), "", "", text};
    if (at != std::string::npos) {
      const bool wide = at + 1 < text.size() && text[at + 1] == '=';
      condition.op = text.substr(at, wide ? 2 : 1);
      condition.value = withoutEndBlanks(text.substr(at + condition.op.size()));
      if (condition.op == "==") condition.op = "=";
    }
    const bool is_order = condition.op.starts_with('<') || condition.op.starts_with('>');
    if (condition.name.empty() || condition.op.empty() || condition.op == "!" ||
        condition.value.find_first_of("=<>!") == 0 || (is_order && std::isnan(numberOrNaN(condition.value))))
      throw UsageError("--where " + inShort(text) +
                       ": expected NAME=VALUE, NAME!=VALUE, or NAME<NUMBER with <, <=, > or >=; a VALUE that begins "
                       "with = < > or ! needs \\ before it");
    conditions_.push_back(std::move(condition));
  }
}

std::vector<std::uint32_t> CellFilter::select(const TileSet& set, const CellAttributes& attributes) const {
  std::vector<bool> chosen(set.cell_count(), true);
  for (const Condition& condition : conditions_) {
    const auto column = attributes.find(condition.name);
    if (!column)
      throw UsageError("--where " + inShort(condition.whole) + ": " + unknownAttribute(condition.name, attributes));
    const bool differs = condition.op == "!=";
    const bool text = attributes.columns()[*column].type == AttributeType::text;
    if (!differs && condition.op != "=") {
      if (text)
        throw UsageError("--where " + inShort(condition.whole) + ": " + escaped(condition.name, 80) +
                         " holds text, so only = and != apply");
      const long double limit = exactOrNaN(condition.value);
      for (std::uint32_t i = 0; i < chosen.size(); ++i)  // NaN compares false
        chosen[i] = chosen[i] && compares(exactOf(attributes.value(*column, i)), condition.op, limit);
      continue;
    }
    std::vector<bool> meets(chosen.size(), false);
    if (text) {
      const std::vector<std::string>& dictionary = attributes.dictionary(*column);
      std::vector<bool> of_code;
      for (const std::string& entry : dictionary) of_code.push_back(matches(condition.value, entry));
      const std::vector<std::uint32_t> codes = attributes.codes(*column);
      for (std::size_t i = 0; i < meets.size(); ++i)
        meets[i] = codes[i] == CellAttributes::kNoCode ? condition.value.empty() : of_code[codes[i]];
    } else {
      const long double limit = exactOrNaN(condition.value);
      for (std::uint32_t i = 0; i < meets.size(); ++i) {
        if (!chosen[i]) continue;
        const AttributeValue value = attributes.value(*column, i);
        meets[i] = isMissing(value) ? condition.value.empty()
                                    : matches(condition.value, textOf(value)) || exactOf(value) == limit;
      }
    }
    for (std::size_t i = 0; i < chosen.size(); ++i) chosen[i] = chosen[i] && meets[i] != differs;
  }
  std::vector<std::uint32_t> cells;
  for (std::uint32_t i = 0; i < chosen.size(); ++i)
    if (chosen[i] && !set.cell(i).removed) cells.push_back(i);
  return cells;
}

}  // namespace filiform
