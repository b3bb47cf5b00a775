// filiform.h: one cell as arrays, and paths along it.
#include "tools/c/open_set.h"

#include <algorithm>
#include <limits>
#include <string>

namespace filiform::c {

namespace {

// Without loops, a segment has the rank of its child; a root has none. The array then lists the segments by rank.
std::vector<std::uint32_t> endsOf(const CellGraph& graph) {
  std::vector<std::uint32_t> ends;
  if (graph.isGraph()) {
    for (const auto& [child, parent] : graph.links) ends.insert(ends.end(), {child, parent});
    return ends;
  }
  for (std::uint32_t child = 0; child < graph.samples(); ++child)
    if (graph.parents[child] != kNoParent) ends.insert(ends.end(), {child, graph.parents[child]});
  return ends;
}

filiform_place placeFrom(const CellPlace& place) { return {place.segment, 0, place.t}; }

}  // namespace

OpenCell::OpenCell(CellGraph graph) : paths(std::move(graph)), ends(endsOf(paths.graph())) {
  points_um.reserve(3 * paths.samples());
  for (std::uint32_t rank = 0; rank < paths.samples(); ++rank) {
    const Vector3d p_W = paths.graph().position_W(rank);
    points_um.insert(points_um.end(), p_W.data(), p_W.data() + 3);
  }
}

CellPlace OpenCell::place(const filiform_place& place, const char* name) const {
  const std::optional<CellPlace> found = paths.on(place.segment, place.t);
  if (!found)
    throw UsageError(std::string(name) + ": the cell has no segment " + std::to_string(place.segment) +
                     ", or t is not in 0 to 1");
  return *found;
}

}  // namespace filiform::c

using namespace filiform;
using namespace filiform::c;

static_assert(FILIFORM_NONE == kNoParent);

extern "C" {

int filiform_cell_open(filiform_set* set, uint32_t cell, filiform_cell** handle) {
  return call([&] {
    *required(handle, "handle") = nullptr;
    const HeldSet held(set, "set");
    (*held)->requireCell(cell);
    if ((*held)->set->cell(cell).removed) throw UsageError("cell " + std::to_string(cell) + ": was removed");
    auto opened = std::make_shared<OpenCell>(readCell((*held)->files->kept, cell, true));
    *handle = static_cast<filiform_cell*>(HandleTable::ofProcess().add(HandleKind::cell, std::move(opened)));
  });
}

int filiform_cell_close(filiform_cell* cell) {
  return call([&] { HandleTable::ofProcess().close(cell, HandleKind::cell, "cell"); });
}

int filiform_cell_get_arrays(filiform_cell* cell, filiform_cell_arrays* arrays) {
  return call([&] {
    const HeldCell held(cell, "cell");
    sized(arrays, "arrays");
    const CellGraph& graph = held->paths.graph();
    filiform_cell_arrays told{};
    told.struct_size = arrays->struct_size;
    told.samples = graph.samples();
    told.links = held->ends.size() / 2;
    told.points_um = held->points_um.data();
    told.radii_um = graph.radii_um.data();
    told.types = graph.types.data();
    told.sample_ids = graph.sample_ids.data();
    told.parents = graph.parents.data();
    told.ends = held->ends.data();
    *arrays = told;
  });
}

int filiform_cell_place(filiform_cell* cell, int64_t sample_id, filiform_place* place) {
  return call([&] {
    *required(place, "place") = {};
    const HeldCell held(cell, "cell");
    const std::vector<std::int64_t>& ids = held->paths.graph().sample_ids;
    const auto found = std::find(ids.begin(), ids.end(), sample_id);
    if (found == ids.end()) throw UsageError("sample_id: the cell has no sample " + std::to_string(sample_id));
    *place = placeFrom(held->paths.at(static_cast<std::uint32_t>(found - ids.begin())));
  });
}

int filiform_cell_distance(filiform_cell* cell, filiform_place from, filiform_place to, double* length_um) {
  return call([&] {
    *required(length_um, "length_um") = 0;
    const HeldCell held(cell, "cell");
    const CellPlace begin = held->place(from, "from"), end = held->place(to, "to");
    *length_um = held->paths.length_um(begin, end).value_or(std::numeric_limits<double>::infinity());
  });
}

int filiform_cell_distances(filiform_cell* cell, filiform_place from, double* lengths_um) {
  return call([&] {
    const HeldCell held(cell, "cell");
    required(lengths_um, "lengths_um");
    const std::vector<double> lengths = held->paths.lengths_um(held->place(from, "from"));
    std::copy(lengths.begin(), lengths.end(), lengths_um);
  });
}

int filiform_cell_farthest_tip(filiform_cell* cell, filiform_place from, filiform_place* tip, uint32_t* rank,
                               double* length_um) {
  return call([&] {
    *required(tip, "tip") = {};
    const HeldCell held(cell, "cell");
    const CellPlace begin = held->place(from, "from");
    const std::optional<std::uint32_t> found = held->paths.farthestTip(begin);
    if (!found) throw UsageError("from: no path leads to a tip");
    *tip = placeFrom(held->paths.at(*found));
    if (rank != nullptr) *rank = *found;
    if (length_um != nullptr) *length_um = *held->paths.length_um(begin, held->paths.at(*found));
  });
}

int filiform_cell_path(filiform_cell* cell, filiform_place from, filiform_place to, filiform_path_point** points,
                       size_t* count) {
  return call([&] {
    *required(points, "points") = nullptr;
    *required(count, "count") = 0;
    const HeldCell held(cell, "cell");
    const CellPlace begin = held->place(from, "from"), end = held->place(to, "to");
    const std::optional<CellPath> path = held->paths.path(begin, end);
    if (!path) throw UsageError("to: no path joins the places");
    std::vector<filiform_path_point> told;
    told.reserve(path->points.size());
    for (const CellPath::Point& point : path->points) {
      filiform_path_point& next = told.emplace_back();
      std::copy_n(point.p_W.data(), 3, next.point_um);
      next.along_um = point.along_um;
      next.rank = point.sample.value_or(FILIFORM_NONE);
      if (point.sample) next.sample_id = held->paths.graph().sample_ids[*point.sample];
    }
    *points = arrayOf(told);
    *count = told.size();
  });
}

}  // extern "C"
