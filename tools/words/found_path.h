// FoundPath: the path along a cell between two places that a user names. Functions without state.
#pragma once

#include "index/query/cell_paths.h"
#include "index/query/cell_sections.h"
#include "solver/travel/places/cell_place_text.h"

#include <functional>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::tools {

struct FoundPath {
  CellPlace from, to;
  CellPath path;
  std::string note;  // not empty: what the user should know about the choice of the places
  double straight_um() const { return (path.points.back().p_W - path.points.front().p_W).norm(); }
};

// The path between two places of the cell. If sample ids repeat: the connected places of lowest ranks. Calls `poll`
// between searches; its exceptions propagate. Throws UsageError as placesOf() does, and if no path joins the places.
// O(samples log samples) for each place that `from` means.
FoundPath pathBetween(const CellPaths& cell, const CellPlaceText& from, const CellPlaceText& to,
                      const std::function<void()>& poll);
// The path to the tip that is farthest along the cell. Throws UsageError as placesOf() does, and if no tip is reached.
FoundPath pathToFarthestTip(const CellPaths& cell, const CellPlaceText& from);

// A place as the user writes it, without the cell: {sample id, t}, the sample at t = 0.
std::pair<std::int64_t, double> placeName(const CellPaths& cell, const CellPlace& place);
// cell, length_um, straight_um, from, to. With `sections`, the two places also have section_id and section_pos.
nlohmann::ordered_json pathHeadJson(const CellPaths& cell, const FoundPath& found,
                                    const CellSections* sections = nullptr);
// sample (null between two samples), x, y, z, along.
nlohmann::ordered_json pathPointJson(const CellPaths& cell, const CellPath::Point& point);

}  // namespace filiform::tools
