// Attributes of cells, such as `mtype` or `layer`: named values that a circuit or a table states beside the shape.
//
// Thread rule: values and pure functions.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace filiform {

enum class AttributeType : std::uint8_t { text, integer, real };
std::string_view name(AttributeType type);  // "text", "integer", "real"

// monostate: the cell has no value. A real is never NaN.
using AttributeValue = std::variant<std::monostate, std::string, std::int64_t, double>;

struct CellAttribute {
  std::string name;
  AttributeValue value;
};

inline bool isMissing(const AttributeValue& value) { return value.index() == 0; }
// The type of a value that is not missing.
AttributeType typeOf(const AttributeValue& value);
// The value as text: integers in decimal, reals with the fewest decimals that read back as the same double. Empty if
// it is missing. Not escaped.
std::string textOf(const AttributeValue& value);
// The number that a value states: of an integer or a real. nullopt for text and missing values.
std::optional<double> numberOf(const AttributeValue& value);

// Reads text of a table. An integer is a decimal without leading zeros or a plus sign, so that textOf() gives the same
// text. A real is any other finite number without leading zeros. Everything else is text; empty text is missing.
AttributeValue attributeFrom(std::string_view text);

}  // namespace filiform
