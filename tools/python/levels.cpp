// Levels of detail in Python: the segments that draw a box.
#include "index/errors.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"

#include <vector>

namespace filiform::python {

struct LevelRow {
  double x0, y0, z0, x1, y1, z1;
  float radius;
  std::uint16_t type;
  std::uint32_t cell;
};

namespace {

// Appends the tile's owned segments whose boxes meet the box. `radii` are those of the child.
void appendRows(std::vector<LevelRow>& rows, const Tile& tile, const TileAppearance& appearance, const Vector3d& lo_W,
                const Vector3d& hi_W) {
  for (std::uint32_t s = 0, owned = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    const std::uint32_t at = owned++;
    const Vector3d a = tile.position_W(tile.child(s)), b = tile.position_W(tile.parent(s));
    if ((a.cwiseMin(b).array() > hi_W.array()).any() || (a.cwiseMax(b).array() < lo_W.array()).any()) continue;
    rows.push_back({a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), appearance.radii_um.at(at), appearance.types.at(at),
                    tile.segmentId(s).cell});
  }
}

py::tuple levelsOf(SetHandle& handle, py::handle box_value, py::handle pixels_value, py::handle most_value) {
  const PointsArgument box = pointsArgument("box", box_value);
  if (box.outer_shape != std::vector<py::ssize_t>{2}) throw py::value_error("box: expected two corners, shape (2, 3)");
  const Vector3d lo_W = box.points[0].cwiseMin(box.points[1]), hi_W = box.points[0].cwiseMax(box.points[1]);
  const double pixels = numberArgument("pixels", pixels_value);
  if (!(pixels > 0) || std::isinf(pixels)) throw py::value_error("pixels: must be a finite number above 0");
  const double side_um = (hi_W - lo_W).maxCoeff();
  if (!(side_um > 0)) throw py::value_error("box: its corners must differ");
  const std::uint64_t most = countArgument("segments", most_value, 1);
  const auto open = handle.get();

  std::vector<LevelRow> rows;
  LevelChoice choice;
  {
    const py::gil_scoped_release released;
    const Levels* const levels = open->levels();
    if (levels == nullptr)
      throw InputError("the set has no levels of detail; ingest it without levels=False (--no-levels)");
    LevelView view;
    view.orthographic = true;
    view.pixels_per_rad = pixels / side_um;
    view.eye_W = 0.5 * (lo_W + hi_W);
    for (int axis = 0; axis < 3; ++axis) {
      Vector3d n = Vector3d::Zero();
      n[axis] = 1;
      view.planes.push_back({n, lo_W[axis]});
      view.planes.push_back({-n, -hi_W[axis]});
    }
    choice = levels->choose(view, most);
    SignalCheck check;
    for (const LevelPart& part : choice.parts) {
      if (part.level)
        appendRows(rows, *levels->load(part.tile), levels->loadAppearance(part.tile), lo_W, hi_W);
      else
        appendRows(rows, *open->set().load(part.tile), open->set().loadAppearance(part.tile), lo_W, hi_W);
      for (int i = 0; i < 16; ++i) check();  // a tile takes long
    }
  }
  py::array_t<LevelRow> array(static_cast<py::ssize_t>(rows.size()));
  std::copy(rows.begin(), rows.end(), array.mutable_data());
  return py::make_tuple(std::move(array), choice.error_px * side_um / pixels, choice.hidden, choice.limited);
}

}  // namespace

void addLevels(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(LevelRow, x0, y0, z0, x1, y1, z1, radius, type, cell);
  module.attr("LEVEL_SEGMENT") = py::dtype::of<LevelRow>();
  module.def("levels", &levelsOf);
}

}  // namespace filiform::python
