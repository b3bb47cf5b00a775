// The answers of the read-only interface for CATMAID's clients, such as Neuroglancer's spatially indexed skeletons.
#include "index/query/cell_graph.h"
#include "index/text.h"
#include "tools/serve/routes/doors/catmaid_nodes.h"
#include "tools/serve/routes/service.h"
#include "tools/serve/sets/limits.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace filiform::tools {

namespace {

using CatmaidJson = nlohmann::ordered_json;

CatmaidJson xyzJson(const Vector3d& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

std::uint32_t cellOfSkeleton(const Call& call) {
  const std::string& name = call.captured.at(1);
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  const auto cell = error == std::errc{} && end == name.data() + name.size()
                        ? call.served->catmaidSpace().cellOf(number)
                        : std::nullopt;
  // Clients look for these words.
  if (!cell) throw Refusal(404, "the skeleton '" + escaped(name, 40) + "' doesn't exist");
  return *cell;
}

const CatmaidSpace::Level& levelOf(const Call& call, const CatmaidSpace& space) {
  const std::string type = call.request.parameter("lod_type").value_or("percent");
  if (type != "percent" && type != "absolute") throw Refusal(400, "lod_type: give percent or absolute");
  const double finest = static_cast<double>(space.levels().size() - 1);
  double index = finest;
  if (const auto lod = call.request.number("lod")) index = type == "percent" ? std::round(*lod * finest) : *lod;
  return space.levels().at(static_cast<std::size_t>(std::clamp(index, 0.0, finest)));
}

}  // namespace

// Never the server's token: this one opens nothing.
Answer catmaidTokenAnswer(const Call&) { return jsonAnswer({{"token", "anonymous"}}); }

// The first version whose interface the clients expect.
Answer catmaidVersionAnswer(const Call&) { return jsonAnswer({{"SERVER_VERSION", "2026.05.06.dev11+g0000000"}}); }

Answer catmaidStacksAnswer(const Call& call) {
  return jsonAnswer(CatmaidJson::array({CatmaidJson{{"id", 1}, {"title", call.served->name()}}}));
}

Answer catmaidStackAnswer(const Call& call) {
  const CatmaidSpace& space = call.served->catmaidSpace();
  Vector3d lo_nm = Vector3d::Zero(), hi_nm = Vector3d::Ones();
  const GridBox& bounds = call.served->set().bounds();
  if (!bounds.empty()) {
    const Grid grid = call.served->set().grid();
    lo_nm = (grid.toWorld(bounds.lo) * 1e3).array().floor();
    hi_nm = (grid.toWorld(bounds.hi) * 1e3).array().floor() + 1;  // a box without its upper faces
  }
  CatmaidJson spatial = CatmaidJson::array(), sizes = CatmaidJson::array();
  for (const CatmaidSpace::Level& level : space.levels()) {
    const auto edge = static_cast<std::uint64_t>(space.edge_nm(level));
    sizes.push_back({edge, edge, edge});
    spatial.push_back({{"chunk_size", sizes.back()}, {"limit", level.most_nodes}});
  }
  return jsonAnswer(
      {{"sid", 1},
       {"pid", 1},
       {"stitle", call.served->name()},
       {"dimension", xyzJson(hi_nm - lo_nm)},
       {"resolution", xyzJson(Vector3d::Ones())},
       {"translation", xyzJson(lo_nm)},
       {"metadata",
        {{"read_only", true}, {"spatial", std::move(spatial)}, {"spatial_skeleton_chunk_sizes", std::move(sizes)}}}});
}

Answer catmaidSkeletonsAnswer(const Call& call) {
  const TileStore& store = call.served->store();
  if (store.cell_count() > limits::kDoorCells)
    throw Refusal(413, "the set has more than " + std::to_string(limits::kDoorCells) + " cells, too many for a list");
  call.served->catmaidSpace();  // refuses sets with too many nodes
  std::string body = "[";
  for (std::uint32_t cell = 0; cell < store.cell_count(); ++cell) {
    if (cell % 256 == 0) TimedStore::check();
    if (store.cell(cell).removed) continue;
    if (body.size() > 1) body += ',';
    body += std::to_string(CatmaidSpace::skeleton(cell));
  }
  return {.type = kJsonType, .body = std::move(body) + "]\n"};
}

Answer catmaidNodesAnswer(const Call& call) {
  const auto box = [&](const std::array<const char*, 3>& names) {
    Vector3d p_nm;
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = call.request.number(names.at(static_cast<std::size_t>(axis)));
      if (!value) throw Refusal(400, "give the box as left, top, z1, right, bottom and z2; nm");
      p_nm[axis] = *value;
    }
    return p_nm;
  };
  const CatmaidNodes::Box asked{box({"left", "top", "z1"}), box({"right", "bottom", "z2"})};
  if ((asked.lo_nm.array() >= asked.hi_nm.array()).any())
    throw Refusal(400, "the box is empty: left < right, top < bottom and z1 < z2 are needed");
  const CatmaidSpace& space = call.served->catmaidSpace();
  const CatmaidSpace::Level& level = levelOf(call, space);
  if (level.depth == CatmaidSpace::kFull &&
      call.served->segmentsAround(asked.lo_nm / 1e3, asked.hi_nm / 1e3) > limits::kBoxSegments)
    throw Refusal(413, "the tiles that the box meets hold more than " + std::to_string(limits::kBoxSegments) +
                           " segments; ask for smaller boxes or a lower lod");
  const CatmaidNodes nodes(*call.served, space, level, asked);
  return {.type = kJsonType,
          .body = "[[" + nodes.rows() + "],[],{}," + (nodes.truncated() ? "true" : "false") + ",{},[]]\n"};
}

Answer catmaidSkeletonAnswer(const Call& call) {
  const std::uint32_t cell = cellOfSkeleton(call);
  refuseLargeCell(call.served->store().cell(cell));
  const CatmaidSpace& space = call.served->catmaidSpace();
  const CellGraph graph = readCell(call.served->kept(), cell, true);
  CatmaidJson rows = CatmaidJson::array();
  for (std::uint32_t rank = 0; rank < graph.samples(); ++rank) {
    const Vector3d p_nm = graph.position_W(rank) * 1e3;
    CatmaidJson row{space.node(cell, rank), nullptr, 1, p_nm.x(), p_nm.y(), p_nm.z(), -1, 5, 0};
    if (graph.parents[rank] != kNoParent) row[1] = space.node(cell, graph.parents[rank]);
    if (std::isfinite(graph.radii_um[rank])) row[6] = static_cast<double>(graph.radii_um[rank]) * 1e3;
    rows.push_back(std::move(row));
  }
  return jsonAnswer(CatmaidJson::array(
      {std::move(rows), CatmaidJson::array(), CatmaidJson::object(), CatmaidJson::array(), CatmaidJson::array()}));
}

Answer catmaidRootAnswer(const Call& call) {
  const std::uint32_t cell = cellOfSkeleton(call);
  refuseLargeCell(call.served->store().cell(cell));
  const CellGraph graph = readCell(call.served->kept(), cell, false);
  const auto root = std::find(graph.parents.begin(), graph.parents.end(), kNoParent);
  if (root == graph.parents.end()) throw Refusal(404, "the skeleton has no sample");
  const auto rank = static_cast<std::uint32_t>(root - graph.parents.begin());
  CatmaidJson json{{"root_id", call.served->catmaidSpace().node(cell, rank)}};
  json.update(xyzJson(graph.position_W(rank) * 1e3));
  return jsonAnswer(json);
}

}  // namespace filiform::tools
