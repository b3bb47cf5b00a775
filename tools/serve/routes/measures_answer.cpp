// The answer of the route measures: a part of the table of `filiform measure`.
#include "index/text.h"
#include "tools/serve/routes/service.h"
#include "tools/serve/sets/limits.h"
#include "tools/words/measure_table.h"

#include <utility>

namespace filiform::tools {

namespace {

using Json = nlohmann::ordered_json;

MeasureChoice requestedChoice(const Request& request) {
  MeasureChoice choice;
  choice.rows = parseMeasureRows(request.parameter("per").value_or("cell"), "per");
  if (choice.rows == MeasureRows::kSet)
    throw Refusal(400, "per=set: an answer holds a part of the cells; give cell, neurite, branch or type");
  choice.features = parseFeatures(request.parameter("features").value_or(kUsualFeatures), "features");
  if (const auto type = request.parameter("type")) choice.types = parseNeuriteTypes(*type, "type");
  choice.sholl_um = request.number("sholl").value_or(0);
  if (request.parameter("sholl") && !(choice.sholl_um > 0)) throw Refusal(400, "sholl: the step must be above 0 um");
  if (choice.sholl_um > 0 && choice.rows == MeasureRows::kBranch)
    throw Refusal(400, "sholl: a Sholl analysis is of a neurite or more; leave out per=branch");
  return choice;
}

}  // namespace

Answer measuresAnswer(const Call& call) {
  const MeasureTable table(call.served->store(), requestedChoice(call.request));
  std::vector<std::uint32_t> cells;
  std::uint64_t samples = 0;
  const auto next = eachListedCell(call, [&](std::uint32_t cell, const CellRecord& record) {
    if (record.samples > limits::kCellSamples)
      throw Refusal(413, "cell " + std::to_string(cell) + ", '" + escaped(record.name, 80) + "', has more than " +
                             std::to_string(limits::kCellSamples) +
                             " samples; use filiform measure on the set's files");
    samples += record.samples;
    if (cells.size() == limits::kListedCells || samples > limits::kCellSamples) return false;
    cells.push_back(cell);
    return true;
  });
  Json rows = Json::array();
  table.measure(
      cells, 1, [](std::size_t) { TimedStore::check(); },
      [&](const MeasureTable::Row& row) {
        if (rows.size() * row.size() >= limits::kMeasuredValues)
          throw Refusal(413, "the answer has more than " + std::to_string(limits::kMeasuredValues) +
                                 " values; give name= or where= for fewer cells, or fewer features");
        Json& json = rows.emplace_back(Json::object());
        for (std::size_t i = 0; i < row.size(); ++i) json[table.columns()[i].title] = measureJson(row[i]);
      });
  return jsonAnswer(
      {{"truncated", next.has_value()}, {"cursor", next ? Json(*next) : Json(nullptr)}, {"rows", std::move(rows)}});
}

}  // namespace filiform::tools
