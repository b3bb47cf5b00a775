// SetHandle in Python: all segments, or those of a box, cells or types, in one pass over the tiles.
#include "index/errors.h"
#include "index/query/segment_pass.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"
#include "tools/words/filter_words.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <pybind11/stl.h>
#include <span>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

namespace filiform::python {

// All fields of a row; Python chooses of them. Not in an unnamed namespace: NumPy's types are looked up by it.
struct PassedRow {
  std::uint32_t cell, segment;
  std::int64_t sample;
  std::int32_t type;
  float radius;
  double x0, y0, z0, x1, y1, z1, length;
};

namespace {

// Gives Python the rows of a pass in parts. Thread rule: one thread at a time. Python's global lock keeps a second
// thread out while a thread begins a part.
class PythonSegments {
 public:
  PythonSegments(SetHandle& handle, py::dtype row, const std::optional<py::tuple>& box,
                 std::optional<std::vector<std::uint32_t>> cells, const std::string& types, py::handle workers)
      : open_(handle.get()), process_(getpid()), row_(std::move(row)) {
    const auto all = py::dtype::of<PassedRow>();
    for (const auto& name : row_.attr("names")) {
      const auto field = py::cast<py::tuple>(row_.attr("fields")[name]);
      const auto known = py::cast<py::tuple>(all.attr("fields")[name]);
      const bool is_wide = known[0].attr("itemsize").cast<std::size_t>() == 8;
      (is_wide ? wide_ : narrow_).push_back({known[1].cast<std::size_t>(), field[1].cast<std::size_t>()});
      const auto text = name.cast<std::string>();
      wants_ids_ = wants_ids_ || text == "sample";
      wants_look_ = wants_look_ || text == "type" || text == "radius";
    }
    if (!types.empty()) types_ = tools::parseSegmentTypes(types, ',', "type");
    SegmentPass pass{.with_appearance = wants_look_ || !types_.empty(),
                     .cells = std::move(cells),
                     .threads = workersArgument(workers),
                     .check = [this] { (*check_)(); }};
    const Grid grid = open_->set().grid();
    if (box) {
      constexpr double kEdge = Grid::kMaxCoordinate_um;
      const Vector3d a = pointArgument("box", (*box)[0]), b = pointArgument("box", (*box)[1]);
      pass.box.emplace(grid.snap(a.cwiseMin(b).cwiseMax(-kEdge).cwiseMin(kEdge)),
                       grid.snap(a.cwiseMax(b).cwiseMax(-kEdge).cwiseMin(kEdge)));
    }
    reader_ = std::make_unique<SegmentReader>(open_->set(), std::move(pass));
  }
  ~PythonSegments() {
    if (process_ != getpid()) reader_.release();  // its threads exist only in the parent
  }
  PythonSegments(const PythonSegments&) = delete;
  PythonSegments& operator=(const PythonSegments&) = delete;

  // At most `most` rows; fewer only at the end.
  py::array next(std::size_t most) {
    if (process_ != getpid()) throw UsageError("segments: begun before fork(); ask again in this process");
    if (busy_) throw UsageError("segments: another thread takes the next rows; give each thread its own iterator");
    if (ended_) return array(0);
    const SetCounts& counts = open_->set().counts();
    most = static_cast<std::size_t>(std::min<std::uint64_t>(most, counts.segments + counts.isolated));
    py::array rows = array(most);
    auto* const to = static_cast<char*>(rows.mutable_data());
    std::size_t filled = 0;
    busy_ = true;
    try {
      const py::gil_scoped_release released;
      filled = fill(to, most);
    } catch (...) {
      busy_ = false;
      ended_ = true;
      throw;
    }
    busy_ = false;
    return filled == most ? rows
                          : py::cast<py::array>(rows[py::slice(0, static_cast<py::ssize_t>(filled), 1)].attr("copy")());
  }

 private:
  struct Column {
    std::size_t from, to;  // offsets in PassedRow and in the row
  };

  py::array array(std::size_t rows) const {
    return py::array(row_, std::vector<py::ssize_t>{static_cast<py::ssize_t>(rows)});
  }

  std::size_t fill(char* to, std::size_t most) {
    SignalCheck check;
    check_ = &check;
    const Grid grid = open_->set().grid();
    const auto stride = static_cast<std::size_t>(row_size_);
    std::size_t filled = 0;
    while (filled < most) {
      if (at_ == rest_.size()) {
        rest_ = reader_->next(), at_ = 0;
        if (rest_.empty()) {
          ended_ = true;
          break;
        }
      }
      for (; at_ < rest_.size() && filled < most; ++at_) {
        const PassedSegment& s = rest_[at_];
        if (!types_.empty() && !std::binary_search(types_.begin(), types_.end(), s.type)) continue;
        const Vector3d child = grid.toWorld(s.child), parent = grid.toWorld(s.parent);
        const PassedRow row{s.id.cell,  s.id.segment, wants_ids_ ? open_->sampleOf(s.id) : 0,
                            s.type,     s.radius_um,  child.x(),
                            child.y(),  child.z(),    parent.x(),
                            parent.y(), parent.z(),   wants_length_ ? (child - parent).norm() : 0};
        const char* const from = reinterpret_cast<const char*>(&row);
        for (const Column& c : narrow_) std::memcpy(to + c.to, from + c.from, 4);
        for (const Column& c : wide_) std::memcpy(to + c.to, from + c.from, 8);
        to += stride;
        ++filled;
      }
    }
    return filled;
  }

  const std::shared_ptr<const OpenSet> open_;
  const pid_t process_;
  const py::dtype row_;
  const py::ssize_t row_size_ = row_.itemsize();
  std::vector<Column> narrow_, wide_;  // of 4 and of 8 bytes
  std::vector<std::uint16_t> types_;   // ascending; empty: all
  bool wants_ids_ = false, wants_look_ = false;
  bool wants_length_ = row_.attr("names").contains("length");
  std::unique_ptr<SegmentReader> reader_;
  SignalCheck* check_ = nullptr;
  std::span<const PassedSegment> rest_;  // of the newest tile
  std::size_t at_ = 0;
  bool busy_ = false, ended_ = false;
};

}  // namespace

void addSegments(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PassedRow, cell, segment, sample, type, radius, x0, y0, z0, x1, y1, z1, length);
  module.attr("SEGMENT") = py::dtype::of<PassedRow>();
  py::class_<PythonSegments>(module, "SegmentReader")
      .def(py::init<SetHandle&, py::dtype, const std::optional<py::tuple>&, std::optional<std::vector<std::uint32_t>>,
                    const std::string&, py::handle>())
      .def("next", &PythonSegments::next);
}

}  // namespace filiform::python
