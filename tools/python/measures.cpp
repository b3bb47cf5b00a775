// SetHandle in Python: measures of cells.
#include "index/measure/neurite_density.h"
#include "index/set/tile_set.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"
#include "tools/words/measure_npy.h"
#include "tools/words/measure_table.h"

#include <algorithm>
#include <optional>
#include <pybind11/stl.h>
#include <string>
#include <utility>
#include <vector>

namespace filiform::python {

struct DensityRow {  // NumPy's types are looked up by it
  std::uint32_t x, y, z, cell;
  std::int32_t type;
  double length;
};

namespace {

// Titles and files .npy, by column.
std::vector<std::pair<std::string, py::bytes>> measureArrays(SetHandle& handle, const std::vector<std::uint32_t>& cells,
                                                             const std::string& per, const std::string& features,
                                                             const std::string& types, double sholl_um,
                                                             py::handle workers_value) {
  tools::MeasureChoice choice;
  choice.rows = tools::parseMeasureRows(per, "per");
  choice.features = tools::parseFeatures(features.empty() ? tools::kUsualFeatures : features, "features");
  if (!types.empty()) choice.types = tools::parseNeuriteTypes(types, "type");
  choice.sholl_um = sholl_um;
  const unsigned workers = workersArgument(workers_value);
  const auto open = handle.get();
  const tools::MeasureTable table(open->set(), std::move(choice));
  tools::MeasureArrays arrays(table.columns());
  {
    const py::gil_scoped_release released;
    SignalCheck check;
    table.measure(
        cells, workers, [&](std::size_t) { check(); }, [&](const tools::MeasureTable::Row& row) { arrays.add(row); });
  }
  std::vector<std::pair<std::string, py::bytes>> found;
  for (std::size_t i = 0; i < table.columns().size(); ++i)
    found.emplace_back(table.columns()[i].title, py::bytes(arrays.npy(i)));
  return found;
}

// Lengths by box, um; the groups of boxes; and the lowest corner, um.
py::tuple density(SetHandle& handle, double step_um, const std::optional<std::vector<std::uint32_t>>& cells,
                  const std::string& types, py::handle workers_value, bool by_cell, bool by_type) {
  DensityOptions options{.step_um = step_um,
                         .cells = cells,
                         .by_cell = by_cell,
                         .by_type = by_type,
                         .threads = workersArgument(workers_value)};
  if (!types.empty()) options.types = tools::parseNeuriteTypes(types, "type");
  const auto open = handle.get();
  SignalCheck check;
  options.check = [&check] { check(); };
  NeuriteDensity found;
  {
    const py::gil_scoped_release released;
    found = densityOf(open->set(), options);
  }
  py::array_t<double> lengths(found.boxes);
  std::copy(found.lengths_um.begin(), found.lengths_um.end(), lengths.mutable_data());
  py::array_t<DensityRow> rows(static_cast<py::ssize_t>(found.groups.size()));
  DensityRow* row = rows.mutable_data();
  const std::size_t area = found.boxes[1] * found.boxes[2];
  for (const DensityGroup& g : found.groups)
    *row++ = {static_cast<std::uint32_t>(g.box / area),
              static_cast<std::uint32_t>(g.box % area / found.boxes[2]),
              static_cast<std::uint32_t>(g.box % found.boxes[2]),
              g.cell,
              g.type,
              g.length_um};
  const Vector3d origin_um = found.corner_um(0, 0, 0);
  return py::make_tuple(std::move(lengths), std::move(rows),
                        py::make_tuple(origin_um.x(), origin_um.y(), origin_um.z()));
}

}  // namespace

void addMeasures(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(DensityRow, x, y, z, cell, type, length);
  module.def("measures", &measureArrays);
  module.def("density", &density);
}

}  // namespace filiform::python
