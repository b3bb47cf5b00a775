// SetHandle in Python: opening and closing, totals, names of cells.
#include "index/cell/glob.h"
#include "index/remote/http_source.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"
#include "tools/words/answer.h"
#include "tools/words/cell_json.h"
#include "tools/words/near_names.h"
#include "tools/words/numbers.h"
#include "tools/words/set_json.h"
#include "tools/words/token.h"

#include <algorithm>
#include <pybind11/stl.h>
#include <string>
#include <utility>
#include <vector>

namespace filiform::python {

namespace {

py::bytes bytesOf(const std::string& text) { return {text.data(), text.size()}; }

py::object boundsOf(const Grid& grid, const GridBox& box) {
  if (box.empty()) return py::none();
  py::array_t<double> bounds({2, 3});
  for (int axis = 0; axis < 3; ++axis) {
    bounds.mutable_at(0, axis) = grid.toWorld(box.lo)[axis];
    bounds.mutable_at(1, axis) = grid.toWorld(box.hi)[axis];
  }
  return bounds;
}

std::string infoOf(SetHandle& handle) {
  const auto open = handle.get();
  const py::gil_scoped_release released;
  return tools::jsonText(tools::setJson(open->set(), open->levels()));
}

// The names as bytes: a name of a file need not be UTF-8. An empty pattern stands for all.
std::vector<std::pair<std::uint32_t, std::string>> cellsNamed(SetHandle& handle, const std::string& pattern) {
  const auto open = handle.get();
  const py::gil_scoped_release released;
  SignalCheck check;
  std::vector<std::pair<std::uint32_t, std::string>> cells;
  for (std::uint32_t id = 0; id < open->set().cell_count(); ++id) {
    check();
    const CellRecord& cell = open->set().cell(id);
    if (!cell.removed && (pattern.empty() || matchesName(pattern, cell.name))) cells.emplace_back(id, cell.name);
  }
  return cells;
}

std::string nearNamesOf(SetHandle& handle, const std::string& wanted) {
  const auto open = handle.get();
  const py::gil_scoped_release released;
  constexpr std::uint32_t kMostCells = 65'536;  // a message must not take long
  tools::NearNames near(wanted);
  for (std::uint32_t id = 0; id < std::min(open->set().cell_count(), kMostCells); ++id)
    if (!open->set().cell(id).removed) near.offer(open->set().cell(id).name);
  return tools::didYouMean(near.names());
}

}  // namespace

void addSet(py::module_& module) {
  py::class_<OpenSet, std::shared_ptr<OpenSet>>(module, "OpenSet");
  module.def("parse_bytes",
             [](const std::string& name, const std::string& text) { return tools::parseBytes(name, text); });
  module.def("is_address", [](const std::string& name) { return isAddress(name); });
  py::class_<SetHandle>(module, "SetHandle")
      .def(py::init([](const std::string& name, const std::string& revision, const std::string& token,
                       const std::string& cache, std::uint64_t budget_bytes) {
        RemoteOptions remote;
        if (!token.empty()) remote.token = tools::tokenIn(token, "token");
        remote.cache_folder = cache;
        const py::gil_scoped_release released;
        return std::make_unique<SetHandle>(name, revision, remote, budget_bytes);
      }))
      .def("close", &SetHandle::close)
      .def_property_readonly("closed", &SetHandle::closed)
      .def("current", [](SetHandle& handle) { return std::const_pointer_cast<OpenSet>(handle.get()); })
      .def("info", &infoOf)
      .def_property_readonly("revision", [](const SetHandle& handle) { return handle.revision(); })
      .def("bounds",
           [](SetHandle& handle) {
             const auto open = handle.get();
             return boundsOf(open->set().grid(), open->set().bounds());
           })
      .def("counts",
           [](SetHandle& handle) {
             const auto open = handle.get();
             const SetCounts& counts = open->set().counts();
             return py::make_tuple(counts.cells, counts.samples, counts.segments, counts.tiles);
           })
      .def("resident_bytes", [](SetHandle& handle) { return handle.get()->nearest().bytes(); })
      .def("is_remote", [](SetHandle& handle) { return handle.get()->set().isRemote(); })
      .def("cell_limit", [](SetHandle& handle) { return handle.get()->set().cell_count(); })
      .def("find_cell",
           [](SetHandle& handle, const std::string& name) {
             const auto open = handle.get();
             const py::gil_scoped_release released;
             return open->set().findCell(name);
           })
      .def("near_names", &nearNamesOf)
      .def("cells_named",
           [](SetHandle& handle, const std::string& pattern) {
             py::list list;
             for (const auto& [id, name] : cellsNamed(handle, pattern)) list.append(py::make_tuple(id, bytesOf(name)));
             return list;
           })
      .def("cell_record", [](SetHandle& handle, std::uint32_t id) -> py::object {
        const auto open = handle.get();
        const CellRecord* record = nullptr;
        {
          const py::gil_scoped_release released;  // reads a page of the table
          if (id < open->set().cell_count()) record = &open->set().cell(id);
        }
        if (record == nullptr || record->removed) return py::none();
        const CellRecord& cell = *record;
        return py::make_tuple(bytesOf(cell.name), bytesOf(cell.source), cell.samples, cell.segments, cell.roots,
                              tools::loopsOf(cell), boundsOf(open->set().grid(), cell.bounds));
      });
}

}  // namespace filiform::python
