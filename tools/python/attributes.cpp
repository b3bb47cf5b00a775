// The attributes of a set's cells in Python, as columns.
#include "index/attributes/cell_attributes.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/set_handle.h"

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace filiform::python {

namespace {

py::list attributeNames(SetHandle& handle) {
  const auto open = handle.get();
  const CellAttributes attributes(open->set());
  py::list names;
  for (const CellAttributes::Column& column : attributes.columns()) names.append(py::bytes(column.name));
  return names;
}

// Integers by cell, and which cells have one, if a double does not hold all of them; else None.
py::object longIntegers(const CellAttributes& attributes, std::uint32_t column, std::uint32_t cells) {
  std::vector<std::int64_t> integers(cells, 0);
  std::vector<std::uint8_t> present(cells, 0);
  bool any_long = false;
  {
    const py::gil_scoped_release released;
    for (std::uint32_t cell = 0; cell < cells; ++cell) {
      const AttributeValue value = attributes.value(column, cell);
      if (isMissing(value)) continue;
      integers[cell] = std::get<std::int64_t>(value);
      present[cell] = 1;
      any_long |= !isExactReal(integers[cell]);
    }
  }
  if (!any_long) return py::none();
  const auto size = static_cast<py::ssize_t>(cells);
  return py::make_tuple(py::array_t<std::int64_t>(size, integers.data()),
                        py::array_t<std::uint8_t>(size, present.data()).attr("astype")("bool"));
}

// None if there is no such column. Of text: codes by cell, and what they stand for. Of integers beyond 2^53: as
// longIntegers() returns them. Else numbers by cell, and None.
py::object attributeColumn(SetHandle& handle, const std::string& name) {
  const auto open = handle.get();
  const CellAttributes attributes(open->set());
  const auto column = attributes.find(name);
  if (!column) return py::none();
  const AttributeType type = attributes.columns()[*column].type;
  const bool is_text = type == AttributeType::text;
  if (type == AttributeType::integer)
    if (py::object integers = longIntegers(attributes, *column, open->set().cell_count()); !integers.is_none())
      return integers;
  std::vector<double> numbers;
  std::vector<std::uint32_t> codes;
  {
    const py::gil_scoped_release released;
    if (is_text)
      codes = attributes.codes(*column);
    else
      numbers = attributes.numbers(*column);
  }
  if (!is_text)
    return py::make_tuple(py::array_t<double>(static_cast<py::ssize_t>(numbers.size()), numbers.data()), py::none());
  py::list texts;
  for (const std::string& text : attributes.dictionary(*column)) texts.append(py::bytes(text));
  return py::make_tuple(py::array_t<std::uint32_t>(static_cast<py::ssize_t>(codes.size()), codes.data()), texts);
}

}  // namespace

void addAttributes(py::module_& module) {
  module.def("attribute_names", &attributeNames);
  module.def("attribute_column", &attributeColumn);
}

}  // namespace filiform::python
