// The rows of `compare`: a cell of two sets, or two traces, as JSON, TSV and text. Thread rule: pure functions.
#pragma once

#include "index/compare/set_changes.h"

#include <string>

#include <nlohmann/json.hpp>

namespace filiform::tools {

// An object with the same fields for every cell; null: the field does not apply. tools/README.md lists them.
// `with_distances`: also those of CellDifference::distance.
nlohmann::ordered_json differenceJson(const CellDifference& cell, bool with_distances);

// The same as a line of TSV, with - for null, and the line of titles.
std::string differenceRow(const CellDifference& cell, bool with_distances);
std::string differenceTitles(bool with_distances);

// A line for people, or one for each trace if distances were measured. `within_um`: for which they were.
std::string differenceText(const CellDifference& cell, double within_um);

}  // namespace filiform::tools
