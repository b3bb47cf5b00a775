#include "tools/words/cell_place_text.h"

#include "index/errors.h"
#include "index/query/cell_paths.h"
#include "index/text.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

namespace filiform::tools {

namespace {

std::string nearestIds(const std::vector<std::int64_t>& ids, std::int64_t wanted) {
  std::optional<std::int64_t> below, above;
  for (const std::int64_t id : ids) {
    if (id < wanted) below = std::max(below.value_or(id), id);
    if (id > wanted) above = std::min(above.value_or(id), id);
  }
  if (below && above) return "; the nearest ids are " + std::to_string(*below) + " and " + std::to_string(*above);
  if (below) return "; its highest id is " + std::to_string(*below);
  return above ? "; its lowest id is " + std::to_string(*above) : "";
}

}  // namespace

CellPlaceText parseCellPlace(const std::string& option, const std::string& text) {
  CellPlaceText place;
  place.option = option + " " + escaped(text, 80);
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos)
    throw UsageError(place.option + ": give CELL:SAMPLE, the sample by its id in the file, such as " +
                     escaped(text, 80) + ":1");
  place.cell = text.substr(0, colon);
  const std::string_view after = std::string_view(text).substr(colon + 1);
  const std::size_t plus = after.find('+');
  const std::string_view id = after.substr(0, plus);
  const auto [end, error] = std::from_chars(id.data(), id.data() + id.size(), place.sample);
  if (error != std::errc{} || end != id.data() + id.size())
    throw UsageError(place.option + ": '" + escaped(id, 80) +
                     "' is no sample id; give CELL:SAMPLE or CELL:SAMPLE+T with a whole number as SAMPLE");
  if (plus == std::string_view::npos) return place;
  place.t = parseNumber(place.option + ": T", std::string(after.substr(plus + 1)));
  if (!(place.t >= 0 && place.t <= 1))
    throw UsageError(place.option + ": give a T from 0 (the sample) to 1 (its parent)");
  return place;
}

std::vector<CellPlace> placesOf(const CellPaths& cell, const CellPlaceText& text) {
  const std::vector<std::int64_t>& ids = cell.graph().sample_ids;
  const std::string name = "'" + escaped(cell.graph().name, 80) + "'", sample = std::to_string(text.sample);
  std::vector<CellPlace> places;
  bool is_there = false;
  std::size_t segments = 0;
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    if (ids[rank] != text.sample) continue;
    is_there = true;
    if (text.t == 0) {
      places.push_back(cell.at(rank));
      continue;
    }
    std::vector<CellPlace> here;
    for (const std::uint32_t segment : cell.segmentsAt(rank))
      if (const auto place = cell.on(segment, text.t); place && place->child == rank && place->parent != rank)
        here.push_back(*place);
    segments = std::max(segments, here.size());
    if (here.size() == 1) places.push_back(here.front());
  }
  if (!is_there)
    throw UsageError(text.option + ": " + name + " has no sample " + sample + nearestIds(ids, text.sample));
  if (places.empty())
    throw UsageError(text.option + ": sample " + sample + " of " + name +
                     (segments == 0 ? " has no parent, so +T is no place"
                                    : " has " + formatCount(segments) + " parents (the cell has loops)") +
                     "; give a sample without +T");
  return places;
}

}  // namespace filiform::tools
