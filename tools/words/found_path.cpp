#include "tools/words/found_path.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/words/numbers.h"

#include <cmath>

namespace filiform::tools {

namespace {

std::string quotedName(const CellPaths& cell) { return "'" + escaped(cell.graph().name, 80) + "'"; }

std::string severalPlaces(const CellPaths& cell, bool of_somata) {
  return of_somata ? quotedName(cell) + " has several somata" : "sample ids repeat in " + quotedName(cell);
}

std::string idText(const CellPaths& cell, const CellPlace& place) {
  return std::to_string(placeName(cell, place).first);
}

nlohmann::ordered_json placeJson(const CellPaths& cell, const CellPlace& place, const CellSections* sections) {
  const auto [id, t] = placeName(cell, place);
  const Vector3d p_W = cell.position_W(place);
  nlohmann::ordered_json json{{"sample", id}, {"t", t}, {"x", p_W.x()}, {"y", p_W.y()}, {"z", p_W.z()}};
  if (sections != nullptr) {
    const auto [section, pos] = sections->of(place);
    json["section_id"] = section;
    json["section_pos"] = pos;
  }
  return json;
}

}  // namespace

FoundPath pathBetween(const CellPaths& cell, const CellPlaceText& from, const CellPlaceText& to,
                      const std::function<void()>& poll) {
  const std::vector<CellPlace> begins = placesOf(cell, from), ends = placesOf(cell, to);
  for (const CellPlace& begin : begins) {
    poll();
    const std::vector<double> lengths = cell.lengths_um(begin);
    for (const CellPlace& end : ends) {
      if (!std::isfinite(lengths[end.child])) continue;
      const bool several = begins.size() > 1 || ends.size() > 1;
      return {begin, end, *cell.path(begin, end),
              several ? severalPlaces(cell, from.soma || to.soma) + "; the path joins the first two that are connected"
                      : ""};
    }
  }
  std::size_t trees = 0;
  for (const std::uint32_t parent : cell.graph().parents) trees += parent == kNoParent ? 1 : 0;
  throw UsageError("samples " + idText(cell, begins.front()) + " and " + idText(cell, ends.front()) + " of " +
                   quotedName(cell) + " are not connected: the cell has " + formatCount(trees) +
                   " separate trees; choose two samples of one tree");
}

FoundPath pathToFarthestTip(const CellPaths& cell, const CellPlaceText& from) {
  const std::vector<CellPlace> begins = placesOf(cell, from);
  const auto tip = cell.farthestTip(begins.front());
  if (!tip)
    throw UsageError(from.option + ": no tip can be reached from sample " + idText(cell, begins.front()) + " of " +
                     quotedName(cell) + "; choose a sample with segments that end in a tip");
  return {begins.front(), cell.at(*tip), *cell.path(begins.front(), cell.at(*tip)),
          begins.size() > 1 ? severalPlaces(cell, from.soma) + "; the path begins at the first" : ""};
}

std::pair<std::int64_t, double> placeName(const CellPaths& cell, const CellPlace& place) {
  const std::vector<std::int64_t>& ids = cell.graph().sample_ids;
  return place.t == 1 ? std::pair(ids[place.parent], 0.0) : std::pair(ids[place.child], place.t);
}

nlohmann::ordered_json pathHeadJson(const CellPaths& cell, const FoundPath& found, const CellSections* sections) {
  return {{"cell", cell.graph().name},
          {"length_um", found.path.length_um()},
          {"straight_um", found.straight_um()},
          {"from", placeJson(cell, found.from, sections)},
          {"to", placeJson(cell, found.to, sections)}};
}

nlohmann::ordered_json pathPointJson(const CellPaths& cell, const CellPath::Point& point) {
  nlohmann::ordered_json row{
      {"sample", nullptr}, {"x", point.p_W.x()}, {"y", point.p_W.y()}, {"z", point.p_W.z()}, {"along", point.along_um}};
  if (point.sample) row["sample"] = cell.graph().sample_ids[*point.sample];
  return row;
}

}  // namespace filiform::tools
