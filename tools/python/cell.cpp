// One cell in Python: its arrays, its paths, its SWC.
#include "index/errors.h"
#include "index/geometry/closest_point.h"
#include "index/output.h"
#include "index/query/cell_pass.h"
#include "index/query/cell_paths.h"
#include "index/text.h"
#include "solver/travel/places/cell_place_text.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <sstream>
#include <utility>

namespace filiform::python {

struct NodeRow {  // the columns of navis
  std::int64_t node_id;
  std::int32_t label;
  double x, y, z, radius;
  std::int64_t parent_id;
};

namespace {

class PythonCell {
 public:
  explicit PythonCell(CellGraph graph) : graph_(std::move(graph)) {
    if (!graph_.block_starts.empty()) shifted_ids_ = distinctIds(graph_);
  }
  const CellGraph& graph() const { return graph_; }
  // By rank, each once.
  const std::vector<std::int64_t>& ids() const {
    return graph_.block_starts.empty() ? graph_.sample_ids : shifted_ids_;
  }
  // Made at the first call, with a copy of the graph: most cells are only read.
  const CellPaths& paths() const {
    const std::lock_guard lock(mutex_);
    if (!paths_) paths_ = std::make_unique<CellPaths>(graph_);
    return *paths_;
  }
  std::string quotedName() const { return "'" + escaped(graph().name, 80) + "'"; }

  std::uint32_t rankOf(const char* name, std::int64_t id) const {
    const auto found = std::find(ids().begin(), ids().end(), id);
    if (found == ids().end())
      throw py::key_error(std::string(name) + ": the cell " + quotedName() + " has no sample " + std::to_string(id));
    return static_cast<std::uint32_t>(found - ids().begin());
  }

  // A sample id; a text as "soma"; an array, a point; or (segment, point): the place on it that is nearest to the
  // point.
  CellPlace place(const char* name, py::handle value) const {
    if (py::isinstance<py::str>(value)) {
      const auto given = value.cast<std::string>();
      std::optional<CellPlaceText> text = readCellPlace(":" + given);
      if (!text)
        throw py::value_error(std::string(name) + ": '" + inShort(given) +
                              "' is no place; give 'soma', a sample id or a point");
      if (!text->soma && !text->p_W && !text->section && text->t == 0) return paths().at(rankOf(name, text->sample));
      text->option = std::string(name) + " '" + inShort(given) + "'";
      return placesOf(paths(), *text).front();
    }
    if (py::isinstance<py::array>(value)) {
      CellPlaceText text;
      text.p_W = pointArgument(name, value);
      return placesOf(paths(), text).front();
    }
    if (!py::isinstance<py::tuple>(value)) return paths().at(rankOf(name, integerArgument(name, value)));
    const auto parts = py::reinterpret_borrow<py::tuple>(value);
    const std::uint64_t segment = countArgument(name, parts[0], 0);
    const Vector3d p_W = pointArgument(name, parts[1]);
    const auto at = segment <= UINT32_MAX ? paths().on(static_cast<std::uint32_t>(segment), 0) : std::nullopt;
    if (!at)
      throw py::key_error(std::string(name) + ": the cell " + quotedName() + " has no segment " +
                          std::to_string(segment));
    const double t = closestPoint(graph().position_W(at->child), graph().position_W(at->parent), p_W).t;
    return *paths().on(at->segment, t);
  }

 private:
  CellGraph graph_;
  std::vector<std::int64_t> shifted_ids_;  // only where a file restarts its ids
  mutable std::mutex mutex_;
  mutable std::unique_ptr<const CellPaths> paths_;
};

std::unique_ptr<PythonCell> readPythonCell(SetHandle& handle, std::uint32_t id) {
  const auto open = handle.get();
  if (id >= open->set().cell_count() || open->set().cell(id).removed)
    throw py::key_error("no cell with index " + std::to_string(id));
  const py::gil_scoped_release released;
  return std::make_unique<PythonCell>(readCell(open->kept(), id, true));
}

// Many cells in one pass over their tiles.
py::list readPythonCells(SetHandle& handle, const std::vector<std::uint32_t>& ids) {
  const auto open = handle.get();
  for (const std::uint32_t id : ids)
    if (id >= open->set().cell_count() || open->set().cell(id).removed)
      throw py::key_error("no cell with index " + std::to_string(id));
  SignalCheck check;
  CellPass pass(open->set(), ids, {.check = [&check] { check(); }});
  py::list cells;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    std::unique_ptr<PythonCell> cell;
    {
      const py::gil_scoped_release released;
      cell = std::make_unique<PythonCell>(pass.next());
    }
    cells.append(py::cast(std::move(cell)));
  }
  return cells;
}

template <typename T>
py::array shared(const std::vector<T>& values, py::handle owner) {
  py::array_t<T> array(static_cast<py::ssize_t>(values.size()), values.data(), owner);
  array.attr("flags").attr("writeable") = false;
  return array;
}

template <typename T>
py::array sealed(py::array_t<T> array) {
  array.attr("flags").attr("writeable") = false;
  return array;
}

py::array nodesOf(const PythonCell& cell) {
  const CellGraph& graph = cell.graph();
  py::array_t<NodeRow> array(static_cast<py::ssize_t>(graph.samples()));
  NodeRow* const rows = array.mutable_data();
  {
    const py::gil_scoped_release released;
    for (std::uint32_t rank = 0; rank < graph.samples(); ++rank) {
      const Vector3d p_W = graph.position_W(rank);
      const std::uint32_t parent = graph.parents[rank];
      rows[rank] = {cell.ids()[rank],
                    graph.types[rank],
                    p_W.x(),
                    p_W.y(),
                    p_W.z(),
                    static_cast<double>(graph.radii_um[rank]),
                    parent == kNoParent ? -1 : cell.ids()[parent]};
    }
  }
  return sealed(std::move(array));
}

py::array verticesOf(const PythonCell& cell) {
  const CellGraph& graph = cell.graph();
  py::array_t<double> array({static_cast<py::ssize_t>(graph.samples()), py::ssize_t{3}});
  double* at = array.mutable_data();
  {
    const py::gil_scoped_release released;
    for (std::uint32_t rank = 0; rank < graph.samples(); ++rank, at += 3) {
      const Vector3d p_W = graph.position_W(rank);
      std::copy_n(p_W.data(), 3, at);
    }
  }
  return sealed(std::move(array));
}

// Ranks of child and parent by the number of the segment. Equal for isolated samples and, without loops, for roots.
py::array endsOf(const PythonCell& cell) {
  const CellGraph& graph = cell.graph();
  py::array_t<std::uint32_t> array(
      {static_cast<py::ssize_t>(graph.isGraph() ? graph.links.size() : graph.samples()), py::ssize_t{2}});
  std::uint32_t* at = array.mutable_data();
  {
    const py::gil_scoped_release released;
    for (const auto& link : graph.links) at = std::copy_n(link.data(), 2, at);
    for (std::uint32_t rank = 0; !graph.isGraph() && rank < graph.samples(); ++rank) {
      *at++ = rank;
      *at++ = graph.parents[rank] == kNoParent ? rank : graph.parents[rank];
    }
  }
  return sealed(std::move(array));
}

// points (N, 3), lengths along the path (N,), sample ids (N,), -1 between two samples.
py::tuple pathOf(const PythonCell& cell, py::handle from_value, py::handle to_value) {
  const CellPlace from = cell.place("start", from_value);
  CellPlace to;
  if (to_value.is_none()) {
    const auto tip = cell.paths().farthestTip(from);
    if (!tip) throw py::value_error("start: no tip can be reached from this place of " + cell.quotedName());
    to = cell.paths().at(*tip);
  } else {
    to = cell.place("end", to_value);
  }
  std::optional<CellPath> path;
  {
    const py::gil_scoped_release released;
    path = cell.paths().path(from, to);
  }
  if (!path)
    throw py::value_error("start, end: no path joins these places of " + cell.quotedName() +
                          "; they lie on separate trees");
  const auto count = static_cast<py::ssize_t>(path->points.size());
  py::array_t<double> points({count, py::ssize_t{3}}), along(count);
  py::array_t<std::int64_t> samples(count);
  for (py::ssize_t i = 0; i < count; ++i) {
    const CellPath::Point& point = path->points[static_cast<std::size_t>(i)];
    std::copy_n(point.p_W.data(), 3, points.mutable_data(i));
    along.mutable_at(i) = point.along_um;
    samples.mutable_at(i) = point.sample ? cell.ids()[*point.sample] : -1;
  }
  return py::make_tuple(std::move(points), std::move(along), std::move(samples));
}

py::array lengthsFrom(const PythonCell& cell, py::handle from_value) {
  const CellPlace from = cell.place("start", from_value);
  std::vector<double> lengths;
  {
    const py::gil_scoped_release released;
    lengths = cell.paths().lengths_um(from);
  }
  return py::array_t<double>(static_cast<py::ssize_t>(lengths.size()), lengths.data());
}

py::array tipsFrom(const PythonCell& cell, py::handle from_value, py::handle most_value) {
  const CellPlace from = cell.place("start", from_value);
  const std::size_t most = most_value.is_none() ? SIZE_MAX : countArgument("most", most_value, 0);
  std::vector<std::int64_t> ids;
  {
    const py::gil_scoped_release released;
    for (const std::uint32_t rank : cell.paths().tips(from, most)) ids.push_back(cell.ids()[rank]);
  }
  return py::array_t<std::int64_t>(static_cast<py::ssize_t>(ids.size()), ids.data());
}

// The nearest samples: ids and distances, each of the points' outer shape. O(points * samples).
py::tuple snap(const PythonCell& cell, py::handle value) {
  const PointsArgument points = pointsArgument("locs", value);
  py::array_t<std::int64_t> ids(points.outer_shape);
  py::array_t<double> distances(points.outer_shape);
  std::int64_t* const id = ids.mutable_data();
  double* const distance = distances.mutable_data();
  if (cell.graph().samples() == 0) throw py::value_error("the cell " + cell.quotedName() + " has no sample");
  {
    const py::gil_scoped_release released;
    SignalCheck check;
    std::vector<Vector3d> samples;
    for (std::uint32_t rank = 0; rank < cell.graph().samples(); ++rank)
      samples.push_back(cell.graph().position_W(rank));
    for (std::size_t i = 0; i < points.points.size(); ++i) {
      double best2 = std::numeric_limits<double>::infinity();
      std::size_t best = 0;
      for (std::size_t rank = 0; rank < samples.size(); ++rank)
        if (const double d2 = (samples[rank] - points.points[i]).squaredNorm(); d2 < best2) best2 = d2, best = rank;
      id[i] = cell.ids()[best];
      distance[i] = std::sqrt(best2);
      check();
    }
  }
  if (!points.outer_shape.empty()) return py::make_tuple(std::move(ids), std::move(distances));
  return py::make_tuple(ids[py::tuple()], distances[py::tuple()]);
}

py::bytes swcText(const PythonCell& cell) {
  std::ostringstream text;
  writeSwc(text, cell.graph());
  return std::move(text).str();
}

void writeSwcFile(const PythonCell& cell, const std::string& path) {
  const py::gil_scoped_release released;
  Output output(path);
  writeSwc(output.stream(), cell.graph());
  output.finish();
}

}  // namespace

void addCell(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(NodeRow, node_id, label, x, y, z, radius, parent_id);
  module.attr("NODE") = py::dtype::of<NodeRow>();
  module.def("read_cells", &readPythonCells);
  py::class_<PythonCell>(module, "CellData")
      .def(py::init(&readPythonCell))
      .def("nodes", &nodesOf)
      .def("vertices", &verticesOf)
      .def("ends", &endsOf)
      .def("node_ids", [](py::object self) { return shared(self.cast<const PythonCell&>().ids(), self); })
      .def("radius", [](py::object self) { return shared(self.cast<const PythonCell&>().graph().radii_um, self); })
      .def("types", [](py::object self) { return shared(self.cast<const PythonCell&>().graph().types, self); })
      .def("path", &pathOf)
      .def("lengths_from", &lengthsFrom)
      .def("tips", &tipsFrom)
      .def("snap", &snap)
      .def("swc", &swcText)
      .def("write_swc", &writeSwcFile);
}

}  // namespace filiform::python
