// The answers of the routes cells, cells/NAME and path.
#include "index/cell/glob.h"
#include "index/query/cell_graph.h"
#include "index/query/cell_paths.h"
#include "index/text.h"
#include "solver/travel/places/cell_place_text.h"
#include "tools/serve/routes/cursor.h"
#include "tools/serve/routes/service.h"
#include "tools/serve/sets/limits.h"
#include "tools/words/cell_json.h"
#include "tools/words/cell_name.h"
#include "tools/words/filter_words.h"
#include "tools/words/found_path.h"
#include "tools/words/npy.h"

#include <cmath>
#include <sstream>

namespace filiform::tools {

namespace {

using Json = nlohmann::ordered_json;

std::uint32_t cellNamed(const ServedSet& served, const std::string& name) {
  const auto cell = served.store().findCell(name);
  if (!cell) throw Refusal(404, "the set has no cell '" + escaped(name, 80) + "'; the route cells lists the names");
  return *cell;
}

// Parallel lists, one entry a sample. `parent` is a position in these lists, -1 for a root.
Json samplesJson(const CellGraph& graph) {
  Json json{{"id", graph.sample_ids}};
  for (const char* name : {"x", "y", "z", "radius", "type", "parent"}) json[name] = Json::array();
  for (std::uint32_t rank = 0; rank < graph.samples(); ++rank) {
    const Vector3d p_W = graph.position_W(rank);
    json["x"].push_back(p_W.x());
    json["y"].push_back(p_W.y());
    json["z"].push_back(p_W.z());
    json["radius"].push_back(std::isfinite(graph.radii_um[rank]) ? Json(graph.radii_um[rank]) : Json(nullptr));
    json["type"].push_back(graph.types[rank]);
    json["parent"].push_back(graph.parents[rank] == kNoParent ? -1 : static_cast<std::int64_t>(graph.parents[rank]));
  }
  return json;
}

// The cells that meet the conditions; nullopt without any.
std::optional<std::vector<bool>> cellsWhere(const ServedSet& served, const std::optional<std::string>& conditions) {
  if (!conditions) return std::nullopt;
  std::vector<bool> chosen(served.set().cell_count());
  for (const std::uint32_t cell : cellsMeeting(served, *conditions)) chosen[cell] = true;
  return chosen;
}

// One record a sample. `parent` is a record's position, -1 for a root.
std::string samplesNpy(const CellGraph& graph) {
  std::string bytes = npyHeader(
      "[('id', '<i8'), ('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('radius', '<f4'), ('type', '<u2'), ('parent', "
      "'<i4')]",
      graph.samples());
  for (std::uint32_t rank = 0; rank < graph.samples(); ++rank) {
    const Vector3d p_W = graph.position_W(rank);
    appendValue(bytes, graph.sample_ids[rank]);
    for (int axis = 0; axis < 3; ++axis) appendValue(bytes, static_cast<double>(p_W[axis]));
    appendValue(bytes, graph.radii_um[rank]);
    appendValue(bytes, graph.types[rank]);
    appendValue(bytes, graph.parents[rank] == kNoParent ? -1 : static_cast<std::int32_t>(graph.parents[rank]));
  }
  return bytes;
}

}  // namespace

std::uint32_t cellLike(const ServedSet& served, const std::string& name, const std::string& parameter) {
  const TileStore& store = served.store();
  if (store.cell_count() > limits::kScannedCells) return cellNamed(served, name);
  try {
    return findCellNamed(store, name, parameter);
  } catch (const UsageError& error) {
    throw Refusal(404, error.what());
  }
}

std::vector<std::uint32_t> cellsMeeting(const ServedSet& served, const std::string& conditions) {
  if (served.set().cell_count() > limits::kScannedCells)
    throw Refusal(413, "where: the set has more than " + std::to_string(limits::kScannedCells) +
                           " cells; use filiform cells --where on the set's files");
  std::vector<std::string> each;
  std::istringstream text(conditions);
  for (std::string condition; std::getline(text, condition, ';');) each.push_back(condition);
  if (each.empty()) each.emplace_back();
  try {
    return CellConditions(each).select(
        served.set(), served.store(), served.attributes(), 1,
        [&](const std::vector<std::uint32_t>& cells, std::size_t done) {
          TimedStore::check();
          std::uint64_t samples = 0;
          for (std::size_t i = 0; done == 0 && i < cells.size(); ++i) samples += served.set().cell(cells[i]).samples;
          if (samples > limits::kCellSamples)
            throw Refusal(413, "where: the cells to measure have more than " + std::to_string(limits::kCellSamples) +
                                   " samples; add conditions on attributes, or use filiform cells --where on the set's "
                                   "files");
        });
  } catch (const UsageError& error) {
    throw Refusal(400, std::string(error.what()).substr(std::string_view("--").size()));
  }
}

void refuseLargeCell(const CellRecord& cell) {
  if (cell.samples > limits::kCellSamples)
    throw Refusal(413, "the cell has more than " + std::to_string(limits::kCellSamples) +
                           " samples; use the program on the set's files");
}

std::optional<std::string> eachListedCell(const Call& call,
                                          const std::function<bool(std::uint32_t, const CellRecord&)>& use) {
  const TileStore& store = call.served->store();
  const std::string glob = call.request.parameter("name").value_or("*");
  const auto chosen = cellsWhere(*call.served, call.request.parameter("where"));
  const std::uint32_t count = store.cell_count();
  const auto place = cursorOf(call, 1);
  const auto first = static_cast<std::uint32_t>(std::min<std::uint64_t>(place ? place->front() : 0, count));
  for (std::uint32_t cell = first; cell < count; ++cell) {
    if (cell - first >= limits::kScannedCells) return cursorText(call, {cell});
    if ((cell - first) % 256 == 0) TimedStore::check();
    const CellRecord& record = store.cell(cell);
    if (record.removed || (chosen && !(*chosen)[cell]) || !matchesName(glob, record.name)) continue;
    if (!use(cell, record)) return cursorText(call, {cell});
  }
  return std::nullopt;
}

Answer cellsAnswer(const Call& call) {
  Json rows = Json::array();
  const auto next = eachListedCell(call, [&](std::uint32_t cell, const CellRecord& record) {
    if (rows.size() == limits::kListedCells) return false;
    rows.push_back(cellJson(cell, record, call.served->store().grid()));
    rows.back().erase("length_um");  // not measured
    if (!call.served->attributes().empty())
      rows.back()["attributes"] = attributesJson(call.served->attributes().of(cell));
    return true;
  });
  return jsonAnswer(
      {{"truncated", next.has_value()}, {"cursor", next ? Json(*next) : Json(nullptr)}, {"cells", std::move(rows)}});
}

Answer cellAnswer(const Call& call) {
  const std::string& file = call.captured.at(1);
  const bool swc = file.ends_with(".swc"), npy = file.ends_with(".npy");
  if (!swc && !npy && !file.ends_with(".json"))
    throw Refusal(404, "give the name of a cell with the ending .json, .swc or .npy");
  const std::uint32_t id = cellNamed(*call.served, file.substr(0, file.size() - (swc || npy ? 4 : 5)));
  const CellRecord& record = call.served->store().cell(id);
  refuseLargeCell(record);
  const CellGraph graph = readCell(call.served->kept(), id, true);
  if (swc) {
    if (graph.isGraph()) throw Refusal(400, "the cell has loops, which SWC cannot hold; ask for .json");
    std::ostringstream text;
    writeSwc(text, graph);
    return {.type = "text/plain; charset=utf-8", .body = std::move(text).str()};
  }
  if (npy) {
    if (graph.isGraph()) throw Refusal(400, "the cell has loops, which a list of parents cannot hold; ask for .json");
    return {.type = kNpyType, .body = samplesNpy(graph)};
  }
  nlohmann::ordered_json json = cellJson(id, record, graph.grid);
  json.erase("length_um");
  if (!call.served->attributes().empty()) json["attributes"] = attributesJson(call.served->attributes().of(id));
  json["truncated"] = false;
  json["samples_by_rank"] = samplesJson(graph);
  if (graph.isGraph()) json["links"] = graph.links;
  return jsonAnswer(json);
}

Answer pathAnswer(const Call& call) {
  const auto from_text = call.request.parameter("from"), to_text = call.request.parameter("to");
  if (!from_text || !to_text)
    throw Refusal(400, "give from=PLACE and to=PLACE, such as CELL:soma or CELL:ID, or to=tip for the farthest tip");
  const CellPlaceText from = parseCellPlace("from", *from_text);
  const std::uint32_t id = cellLike(*call.served, from.cell, "from");
  std::optional<CellPlaceText> to;
  if (*to_text != "tip") {
    to = parseCellPlace("to", *to_text);
    if (cellLike(*call.served, to->cell, "to") != id) throw Refusal(400, "a path joins two places of one cell");
  }
  refuseLargeCell(call.served->store().cell(id));
  const CellPaths cell(readCell(call.served->kept(), id, from.needsTypes() || (to && to->needsTypes())));
  TimedStore::check();
  const FoundPath found = to ? pathBetween(cell, from, *to, TimedStore::check) : pathToFarthestTip(cell, from);
  nlohmann::ordered_json json = pathHeadJson(cell, found);
  json["truncated"] = false;
  json["note"] = found.note;
  json["points"] = nlohmann::ordered_json::array();
  for (const CellPath::Point& point : found.path.points) json["points"].push_back(pathPointJson(cell, point));
  return jsonAnswer(json);
}

}  // namespace filiform::tools
