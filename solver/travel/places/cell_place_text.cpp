#include "solver/travel/places/cell_place_text.h"

#include "index/cell/soma.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/query/cell_paths.h"
#include "index/query/cell_sections.h"
#include "index/query/nearest.h"
#include "index/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

namespace filiform {

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

// Reads a number at the beginning of the text and removes it.
template <typename Number>
bool take(std::string_view& text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

std::optional<Vector3d> pointOf(std::string_view text) {
  Vector3d p_W;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0) {
      if (!text.starts_with(',')) return std::nullopt;
      text.remove_prefix(1);
    }
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    if (!take(text, p_W[axis]) || !(std::abs(p_W[axis]) <= Nearest::kMaxCoordinate_um)) return std::nullopt;
  }
  return text.empty() ? std::optional(p_W) : std::nullopt;
}

// Samples of type 1 whose parent is not: the samples of a soma are linked to each other.
std::vector<CellPlace> somaPlaces(const CellPaths& cell, const std::string& option, const std::string& name) {
  const CellGraph& graph = cell.graph();
  std::vector<CellPlace> places;
  std::optional<std::int64_t> root;
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    const std::uint32_t parent = graph.parents[rank];
    if (parent == kNoParent && !root) root = graph.sample_ids[rank];
    if (graph.types[rank] == kSomaType && (parent == kNoParent || graph.types[parent] != kSomaType))
      places.push_back(cell.at(rank));
  }
  if (places.empty())
    throw UsageError(option + ": " + name + " has no soma (no sample of type 1)" +
                     (root ? "; its first root is sample " + std::to_string(*root) : std::string()));
  return places;
}

CellPlace nearestSample(const CellPaths& cell, const Vector3d& p_W) {
  std::uint32_t best = 0;
  double best2 = std::numeric_limits<double>::infinity();
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank)
    if (const double d2 = (cell.graph().position_W(rank) - p_W).squaredNorm(); d2 < best2) best2 = d2, best = rank;
  return cell.at(best);
}

}  // namespace

std::optional<CellPlaceText> readCellPlace(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return std::nullopt;
  CellPlaceText place;
  place.cell = text.substr(0, colon);
  std::string_view after = std::string_view(text).substr(colon + 1);
  place.soma = lowerCase(after) == "soma";
  if (!place.soma) place.p_W = pointOf(after);
  if (place.soma || place.p_W) return place;
  constexpr std::string_view kSection = "section";
  if (lowerCase(after).starts_with(kSection)) {
    after.remove_prefix(kSection.size());
    std::uint32_t number = 0;
    if (!take(after, number)) return std::nullopt;
    place.section = number;
    place.t = 0.5;
  } else if (!take(after, place.sample)) {
    return std::nullopt;
  }
  if (after.empty()) return place;
  const bool between = after.starts_with('+');
  after.remove_prefix(1);
  return between && take(after, place.t) && after.empty() && place.t >= 0 && place.t <= 1 ? std::optional(place)
                                                                                          : std::nullopt;
}

CellPlaceText parseCellPlace(const std::string& option, const std::string& text) {
  std::optional<CellPlaceText> place = readCellPlace(text);
  if (!place) throw UsageError(option + " " + inShort(text) + ": is no place on a cell; give " + kCellPlaceForms);
  place->option = option + " " + inShort(text);
  return *std::move(place);
}

std::vector<CellPlace> placesOf(const CellPaths& cell, const CellPlaceText& text) {
  const std::vector<std::int64_t>& ids = cell.graph().sample_ids;
  const std::string name = "'" + escaped(cell.graph().name, 80) + "'", sample = std::to_string(text.sample);
  if (text.soma) return somaPlaces(cell, text.option, name);
  if (text.p_W && cell.samples() > 0) return {nearestSample(cell, *text.p_W)};
  if (text.section) {
    const CellSections sections(cell);
    if (const auto place = sections.at(*text.section, text.t)) return {*place};
    throw UsageError(text.option + ": " + name + " has no section " + std::to_string(*text.section) + "; it has " +
                     counted(sections.size(), "section") + ", numbered from 0");
  }
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
                                    : " has " + counted(segments, "parent") + " (the cell has loops)") +
                     "; give a sample without +T");
  return places;
}

}  // namespace filiform
