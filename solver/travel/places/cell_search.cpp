#include "solver/travel/places/cell_search.h"

#include "index/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>
#include <utility>

namespace filiform {

namespace {

std::string withoutBlanks(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

std::optional<Vector3d> point(const std::string& text) {
  Vector3d p;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    const char* const begin = at;
    while (at != end && (*at == ' ' || *at == ',' || *at == '\t')) ++at;
    if (axis > 0 && at == begin) return std::nullopt;
    const auto [rest, error] = std::from_chars(at, end, p[axis]);
    if (error != std::errc() || !std::isfinite(p[axis])) return std::nullopt;
    at = rest;
  }
  return at == end ? std::optional(p) : std::nullopt;
}

}  // namespace

CellQuery parseCellQuery(const std::string& text) {
  CellQuery query;
  query.name = withoutBlanks(text);
  query.p_W = point(query.name);
  if (query.p_W) {
    query.name.clear();
    return query;
  }
  query.place = readCellPlace(query.name);
  if (!query.place) return query;
  query.place->option = inShort(query.name);
  query.name = withoutBlanks(query.place->cell);
  return query;
}

CellMatches matchCells(const TileStore& store, const std::string& text, bool by_source, std::size_t most) {
  struct Found {
    int rank;
    std::uint32_t cell;
  };
  std::vector<Found> found;
  const std::string wanted = lowerCase(text);
  for (std::uint32_t cell = 0; cell < store.cell_count(); ++cell) {
    const CellRecord& record = store.cell(cell);
    if (record.removed) continue;
    const std::string& has = by_source ? record.source : record.name;
    const std::size_t at = lowerCase(has).find(wanted);
    if (at == std::string::npos) continue;
    found.push_back({has == text ? 0 : has.size() == wanted.size() ? 1 : at == 0 ? 2 : 3, cell});
  }
  const std::size_t kept = std::min(most, found.size());
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(),
                    [&](const Found& a, const Found& b) {
                      return std::tuple(a.rank, std::cref(store.cell(a.cell).name).get(), a.cell) <
                             std::tuple(b.rank, std::cref(store.cell(b.cell).name).get(), b.cell);
                    });
  CellMatches matches;
  matches.count = found.size();
  for (std::size_t i = 0; i < kept; ++i) matches.cells.push_back(found[i].cell);
  return matches;
}

std::vector<std::uint32_t> findCells(const TileStore& store, const std::string& text, std::size_t most) {
  CellMatches names = matchCells(store, text, false, most);
  return names.count > 0 ? std::move(names.cells) : matchCells(store, text, true, most).cells;
}

}  // namespace filiform
