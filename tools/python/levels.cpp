// Levels of detail in Python.
#include "index/errors.h"
#include "index/levels/level_rows.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"

#include <vector>

namespace filiform::python {

struct PythonLevelRow {
  double x0, y0, z0, x1, y1, z1;
  float radius;
  std::uint16_t type;
  std::uint32_t cell;
};

namespace {

py::tuple levelsOf(SetHandle& handle, py::handle box_value, py::handle pixels_value, py::handle most_value) {
  const PointsArgument box = pointsArgument("box", box_value);
  if (box.outer_shape != std::vector<py::ssize_t>{2}) throw py::value_error("box: expected two corners, shape (2, 3)");
  SignalCheck check;
  const LevelBox asked{.lo_W = box.points[0].cwiseMin(box.points[1]),
                       .hi_W = box.points[0].cwiseMax(box.points[1]),
                       .pixels = numberArgument("pixels", pixels_value),
                       .most_segments = countArgument("segments", most_value, 1),
                       .check = [&check] {
                         for (int i = 0; i < 16; ++i) check();  // a tile takes long
                       }};
  const auto open = handle.get();
  LevelRows found;
  {
    const py::gil_scoped_release released;
    const Levels* const levels = open->levels();
    if (levels == nullptr)
      throw InputError("the set has no levels of detail; ingest it without levels=False (--no-levels)");
    found = levelRows(open->set(), *levels, asked);
  }
  py::array_t<PythonLevelRow> array(static_cast<py::ssize_t>(found.rows.size()));
  PythonLevelRow* row = array.mutable_data();
  for (const LevelRow& r : found.rows)
    *row++ = {r.child_W.x(),  r.child_W.y(), r.child_W.z(), r.parent_W.x(), r.parent_W.y(),
              r.parent_W.z(), r.radius_um,   r.type,        r.cell};
  return py::make_tuple(std::move(array), found.error_um, found.hidden, found.limited);
}

}  // namespace

void addLevels(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PythonLevelRow, x0, y0, z0, x1, y1, z1, radius, type, cell);
  module.attr("LEVEL_SEGMENT") = py::dtype::of<PythonLevelRow>();
  module.def("levels", &levelsOf);
}

}  // namespace filiform::python
