// SetHandle in Python: nearest segments, boxes, rays.
#include "index/attributes/cell_attributes.h"
#include "index/errors.h"
#include "index/geometry/closest_point.h"
#include "index/workers.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"
#include "tools/words/filter_words.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <pybind11/stl.h>
#include <span>
#include <string>
#include <tuple>
#include <unistd.h>

namespace filiform::python {

// Rows of arrays that Python sees: the names are its fields. Not in an unnamed namespace, because NumPy's types are
// looked up by them.
struct HitRow {
  double distance, x, y, z;
  std::uint32_t cell, segment;
  std::int64_t sample;
  bool exact;
  std::int32_t type;
  double radius, t;
};
struct RayRow {
  double along, distance, x, y, z;
  std::uint32_t cell, segment;
  std::int64_t sample;
  std::int32_t type;
  double radius, t;
};

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::int32_t codeOf(const SegmentLook& look) { return look.type ? std::int32_t{*look.type} : -1; }

HitRow rowOf(const OpenSet& open, const NearestResult& r, const SegmentLook& look) {
  return {r.distance_um,
          r.p_W.x(),
          r.p_W.y(),
          r.p_W.z(),
          r.segment.cell,
          r.segment.segment,
          open.sampleOf(r.segment),
          r.exact,
          codeOf(look),
          look.radius_um,
          r.t};
}

// Where scipy has an infinite distance and an index past the end.
HitRow blankRow(bool exact) { return {kInfinity, kNaN, kNaN, kNaN, UINT32_MAX, UINT32_MAX, -1, exact, -1, kNaN, kNaN}; }

// An array that would not fit the memory is refused before the system has to end the process.
void requireMemory(double rows) {
  static const double memory =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  if (rows * static_cast<double>(sizeof(HitRow)) < 0.8 * memory) return;
  PyErr_SetString(PyExc_MemoryError, "points and k: the result would not fit this machine's memory; ask in parts");
  throw py::error_already_set();
}

// Which segments a search takes: cells (None: all), cells left out, types with commas between, and conditions on
// attributes, which all hold.
using FilterWords = std::tuple<std::optional<std::vector<std::uint32_t>>, std::vector<std::uint32_t>, std::string,
                               std::vector<std::string>>;

// The cells that meet all conditions, ascending.
std::vector<std::uint32_t> cellsMeeting(const OpenSet& open, const std::vector<std::string>& where) try {
  const tools::CellConditions conditions(where);
  const py::gil_scoped_release released;
  SignalCheck check;
  return conditions.select(open.set(), open.set(), CellAttributes(open.set()), 1,
                           [&check](const auto&, std::size_t) { check(); });
} catch (const UsageError& error) {
  throw py::value_error(std::string(error.what()).substr(std::string_view("--").size()));
}

std::shared_ptr<const Nearest> searchOf(const std::shared_ptr<const OpenSet>& open, const FilterWords& words) {
  const auto& [cells, not_cells, types, where] = words;
  tools::FilterParts parts{.not_cells = not_cells};
  if (!types.empty()) parts.types = tools::parseSegmentTypes(types, ',', "type");
  if (!where.empty()) parts.met = cellsMeeting(*open, where);
  if (cells && parts.met)
    std::erase_if(*parts.met,
                  [&cells = cells](std::uint32_t c) { return !std::binary_search(cells->begin(), cells->end(), c); });
  else if (cells)
    parts.met = cells;
  const SegmentFilter filter = tools::filterOf(open->set().cell_count(), std::move(parts));
  if (filter.takesAll()) return {open, &open->nearest()};
  return open->filtered().with(filter);
}

py::object nearest(SetHandle& handle, py::handle points_value, py::handle k_value, py::handle eps_value,
                   py::handle bound_value, py::handle workers_value, bool approximate, const FilterWords& filter,
                   bool own, bool of_cells) {
  const PointsArgument points = pointsArgument("points", points_value);
  const RanksArgument ranks = ranksArgument(k_value);
  NearestQuery query{.k = ranks.count,
                     .epsilon = numberArgument("eps", eps_value),
                     .approximate = approximate,
                     .of_cells = of_cells,
                     .other_cells = !own};
  if (!(query.epsilon >= 0) || std::isinf(query.epsilon))
    throw py::value_error("eps: must be a finite number, 0 or more");
  const double bound = numberArgument("distance_upper_bound", bound_value);
  if (bound < 0) throw py::value_error("distance_upper_bound: must be 0 um or more");
  // scipy's bound is open: what lies exactly at this distance is not found.
  query.max_distance_um = std::isinf(bound) ? bound : std::nextafter(bound, 0);
  const bool none = bound == 0;
  const unsigned workers = workersArgument(workers_value);
  const auto open = handle.get();

  const std::size_t columns = ranks.ranks.empty() ? ranks.count : ranks.ranks.size();
  std::vector<py::ssize_t> shape = points.outer_shape;
  if (!ranks.single) shape.push_back(static_cast<py::ssize_t>(columns));
  requireMemory(static_cast<double>(points.points.size()) * static_cast<double>(columns));
  // More neighbours than segments need not be looked for.
  query.k = static_cast<std::size_t>(
      std::min<std::uint64_t>(query.k, open->set().counts().segments + open->set().counts().isolated));
  py::array_t<HitRow> array(shape);
  HitRow* const rows = array.mutable_data();
  const auto search = searchOf(open, filter);
  {
    const py::gil_scoped_release released;
    const HitRow blank = blankRow(query.epsilon == 0 && !approximate);
    const auto write = [&](std::size_t i, const std::vector<NearestResult>& results, const SegmentLook* looks) {
      HitRow* const row = rows + i * columns;
      for (std::size_t column = 0; column < columns; ++column) {
        const std::size_t rank = ranks.ranks.empty() ? column : ranks.ranks[column];
        row[column] = rank < results.size() ? rowOf(*open, results[rank], looks[rank]) : blank;
      }
    };
    if (none) {
      std::fill_n(rows, points.points.size() * columns, blank);
    } else if (points.points.size() == 1) {
      const std::vector<NearestResult> found = search->find(points.points[0], query);
      write(0, found, open->looks().of(found).data());
    } else {
      SignalCheck check;
      constexpr std::size_t kRows = std::size_t{1} << 18, kLeast = 4096;
      const std::size_t at_once = std::max(kLeast, kRows / std::max<std::size_t>(query.k, 1));
      for (std::size_t begin = 0; begin < points.points.size(); begin += at_once) {
        const auto some = std::span(points.points).subspan(begin, std::min(at_once, points.points.size() - begin));
        std::vector<std::vector<NearestResult>> found(some.size());
        search->forEach(some, query, workers,
                        [&](std::size_t i, std::vector<NearestResult>&& results, const SearchCounts&) {
                          found[i] = std::move(results);
                          check();
                        });
        open->readAhead(found);
        const std::vector<SegmentLook> looks = open->looks().of(found);
        std::vector<const SegmentLook*> look(some.size(), looks.data());  // of a point's first result
        for (std::size_t i = 1; i < some.size(); ++i) look[i] = look[i - 1] + found[i - 1].size();
        runItems(some.size(), workers, [&](std::size_t i) { write(begin + i, found[i], look[i]); });
      }
    }
  }
  if (!points.outer_shape.empty() || !ranks.single) return array;
  return array[py::tuple()];  // a row, not an array of no dimension
}

std::pair<Vector3d, Vector3d> boxArgument(py::handle corner, py::handle opposing) {
  const Vector3d a = pointArgument("corner", corner), b = pointArgument("opposing_corner", opposing);
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

double radiusArgument(py::handle value) {
  const double radius = numberArgument("radius", value);
  if (radius < 0) throw py::value_error("radius: must be 0 um or more");
  return radius;
}

// The ends of the segments, child then parent: N x 6. Reads each tile once.
std::vector<double> endsOfHits(const TileSet& set, const std::vector<NearestResult>& results) {
  std::vector<std::size_t> order(results.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return results[a].tile < results[b].tile; });
  std::vector<double> ends(6 * results.size());
  std::shared_ptr<const Tile> tile;
  for (const std::size_t i : order) {
    if (!tile || tile->id() != results[i].tile) tile = set.load(results[i].tile);
    const auto segment = tile->findSegment(results[i].segment);
    if (!segment) throw CorruptSet(set.place(results[i].tile).first, 0, "a segment vanished between two reads");
    const Vector3d child = tile->position_W(tile->child(*segment)), parent = tile->position_W(tile->parent(*segment));
    for (int axis = 0; axis < 3; ++axis) {
      ends[6 * i + static_cast<std::size_t>(axis)] = child[axis];
      ends[6 * i + 3 + static_cast<std::size_t>(axis)] = parent[axis];
    }
  }
  return ends;
}

// Rows, and with `want_ends` the ends of the segments (N, 6); else None.
py::tuple foundArrays(const OpenSet& open, const std::vector<NearestResult>& results, bool want_ends) {
  py::array_t<HitRow> rows(static_cast<py::ssize_t>(results.size()));
  HitRow* const row = rows.mutable_data();
  py::object ends = py::none();
  std::vector<double> values;
  {
    const py::gil_scoped_release released;
    open.readAhead(results);
    const std::vector<SegmentLook> looks = open.looks().of(results);
    for (std::size_t i = 0; i < results.size(); ++i) row[i] = rowOf(open, results[i], looks[i]);
    if (want_ends) values = endsOfHits(open.set(), results);
  }
  if (want_ends) {
    py::array_t<double> array({static_cast<py::ssize_t>(results.size()), py::ssize_t{6}});
    std::copy(values.begin(), values.end(), array.mutable_data());
    ends = std::move(array);
  }
  return py::make_tuple(std::move(rows), std::move(ends));
}

std::vector<NearestResult> inBox(const Nearest& search, const std::pair<Vector3d, Vector3d>& box) {
  const py::gil_scoped_release released;
  return search.inBox(box.first, box.second);
}

std::vector<NearestResult> inSphere(const Nearest& search, const Vector3d& centre, double radius) {
  const py::gil_scoped_release released;
  return search.find(centre, {.k = SIZE_MAX, .max_distance_um = radius});
}

// By cell: its id and the number of its segments.
py::dict countsOf(const std::map<std::uint32_t, std::uint64_t>& counts) {
  py::dict dict;
  for (const auto& [cell, count] : counts) dict[py::int_(cell)] = count;
  return dict;
}

py::array ray(SetHandle& handle, py::handle origin, py::handle direction, py::handle radius, py::handle slope,
              py::handle length, py::handle most, const FilterWords& filter, bool of_cells) {
  RayQuery query{.origin_W = pointArgument("origin", origin),
                 .direction = pointArgument("direction", direction),
                 .radius_um = radiusArgument(radius),
                 .slope = numberArgument("slope", slope),
                 .length_um = numberArgument("length", length),
                 .of_cells = of_cells};
  if (!(query.direction.norm() > 0)) throw py::value_error("direction: must not be of length 0");
  if (!(query.slope >= 0) || std::isinf(query.slope))
    throw py::value_error("slope: must be a finite number, 0 or more");
  if (!(query.length_um >= 0)) throw py::value_error("length: must be 0 um or more");
  if (!most.is_none()) query.most = static_cast<std::size_t>(countArgument("k", most, 1));
  const auto open = handle.get();
  const auto search = searchOf(open, filter);
  std::vector<RayHit> hits;
  std::vector<SegmentLook> looks;
  {
    const py::gil_scoped_release released;
    hits = search->alongRay(query);
    open->readAhead(hits);
    looks = open->looks().of(hits);
  }
  py::array_t<RayRow> rows(static_cast<py::ssize_t>(hits.size()));
  RayRow* row = rows.mutable_data();
  {
    const py::gil_scoped_release released;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const RayHit& hit = hits[i];
      *row++ = {hit.along_um,
                hit.distance_um,
                hit.p_W.x(),
                hit.p_W.y(),
                hit.p_W.z(),
                hit.segment.cell,
                hit.segment.segment,
                open->sampleOf(hit.segment),
                codeOf(looks[i]),
                looks[i].radius_um,
                hit.t};
    }
  }
  return rows;
}

}  // namespace

void addQueries(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(HitRow, distance, x, y, z, cell, segment, sample, exact, type, radius, t);
  PYBIND11_NUMPY_DTYPE(RayRow, along, distance, x, y, z, cell, segment, sample, type, radius, t);
  module.attr("HIT") = py::dtype::of<HitRow>();
  module.attr("RAY_HIT") = py::dtype::of<RayRow>();
  module.def("nearest", &nearest);
  module.def("cells_meeting", [](SetHandle& handle, const std::vector<std::string>& where) {
    return cellsMeeting(*handle.get(), where);
  });
  module.def("box_query",
             [](SetHandle& handle, py::handle corner, py::handle opposing, bool ends, const FilterWords& filter) {
               const auto box = boxArgument(corner, opposing);
               const auto open = handle.get();
               return foundArrays(*open, inBox(*searchOf(open, filter), box), ends);
             });
  module.def("box_counts",
             [](SetHandle& handle, py::handle corner, py::handle opposing, const FilterWords& filter, bool by_middle) {
               const auto box = boxArgument(corner, opposing);
               const auto open = handle.get();
               const auto search = searchOf(open, filter);
               std::map<std::uint32_t, std::uint64_t> counts;
               {
                 const py::gil_scoped_release released;
                 counts = search->countInBox(box.first, box.second, by_middle);
               }
               return countsOf(counts);
             });
  module.def("sphere_query",
             [](SetHandle& handle, py::handle center, py::handle radius_value, bool ends, const FilterWords& filter) {
               const Vector3d centre = pointArgument("center", center);
               const double radius = radiusArgument(radius_value);
               const auto open = handle.get();
               return foundArrays(*open, inSphere(*searchOf(open, filter), centre, radius), ends);
             });
  module.def("sphere_counts",
             [](SetHandle& handle, py::handle center, py::handle radius_value, const FilterWords& filter) {
               const Vector3d centre = pointArgument("center", center);
               const double radius = radiusArgument(radius_value);
               const auto open = handle.get();
               std::map<std::uint32_t, std::uint64_t> counts;
               for (const NearestResult& found : inSphere(*searchOf(open, filter), centre, radius))
                 ++counts[found.segment.cell];
               return countsOf(counts);
             });
  module.def("ray", &ray);
}

}  // namespace filiform::python
