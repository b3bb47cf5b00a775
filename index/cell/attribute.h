// Attributes of cells, such as `mtype` or `layer`: named values that a circuit or a table states beside the shape.
//
// Thread rule: values and pure functions.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace filiform {

// The type of a column of attributes.
enum class AttributeType : std::uint8_t { text, integer, real };
std::string_view name(AttributeType type);  // "text", "integer", "real"

// monostate: the cell has no value. A real is never NaN.
using AttributeValue = std::variant<std::monostate, std::string, std::int64_t, double>;

// One attribute of a cell.
struct CellAttribute {
  std::string name;
  AttributeValue value;
};

// True if the cell has no value.
inline bool isMissing(const AttributeValue& value) { return value.index() == 0; }
// The type of a value that is not missing.
AttributeType typeOf(const AttributeValue& value);
// The value as text: integers in decimal, reals with the fewest decimals that read back as the same double. Empty if
// it is missing. Not escaped.
std::string textOf(const AttributeValue& value);
// The number that a value states: of an integer or a real. nullopt for text and missing values.
std::optional<double> numberOf(const AttributeValue& value);

// True if a real holds the integer exactly; all up to 2^53 are.
bool isExactReal(std::int64_t integer);

// Reads text of a table. An integer is a decimal without leading zeros or a plus sign, so that textOf() gives the same
// text. A real is any other finite number without leading zeros. Everything else is text; empty text is missing.
AttributeValue attributeFrom(std::string_view text);

// Looks at all fields of a column of a table. A column that holds a word, or integers that a real cannot hold beside
// reals, is text: `7e5` beside `7f3` is a name. Numbers may have a decimal comma, `1,5`, if none has a point, and if
// one of them cannot be a count with separated thousands, as `1,500` can.
class FieldKinds {
 public:
  void add(std::string_view field);
  bool areText() const {
    return any_text_ || (any_real_ && any_long_) || (any_comma_ && (any_point_ || !any_decimal_comma_));
  }
  // The value of a field of this column.
  AttributeValue valueOf(const std::string& field) const;

 private:
  bool any_text_ = false, any_real_ = false, any_long_ = false;
  bool any_point_ = false, any_comma_ = false, any_decimal_comma_ = false;
};

// Numbers for a column of texts if each text reads back exactly: textOf() of each number is the text, and no integer is
// above 2^53. nullopt if one is not, as `007` or `1.50`, or if no text is given. Empty texts are missing values.
std::optional<std::vector<AttributeValue>> exactNumbers(const std::vector<std::string>& texts);

}  // namespace filiform
