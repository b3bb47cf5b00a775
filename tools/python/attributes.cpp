// The attributes of a set's cells in Python, as columns.
#include "index/attributes/cell_attributes.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/set_handle.h"

#include <string>
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

// None if there is no such column. Of text: codes by cell, and what they stand for; else numbers by cell, and None.
py::object attributeColumn(SetHandle& handle, const std::string& name) {
  const auto open = handle.get();
  const CellAttributes attributes(open->set());
  const auto column = attributes.find(name);
  if (!column) return py::none();
  const bool is_text = attributes.columns()[*column].type == AttributeType::text;
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
