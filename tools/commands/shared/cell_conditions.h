// The conditions of --where: on attributes, and on measures: `measure:length>5000`. Thread rule: immutable once made.
#pragma once

#include "index/attributes/cell_filter.h"
#include "index/measure/measures.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

class CellConditions {
 public:
  // Throws UsageError for a condition of another form, and for an unknown feature, with near names.
  explicit CellConditions(const std::vector<std::string>& where);

  // The ids of all cells that meet the conditions, ascending. Removed cells never do. Measures the cells that meet the
  // others, if there are conditions on measures. Throws as CellFilter::select() and measureCells(); Interrupted.
  std::vector<std::uint32_t> select(const TileSet& set, const CellAttributes& attributes, unsigned threads) const;

 private:
  CellFilter attributes_;
  std::vector<std::pair<const Feature*, AttributeConditions::Condition>> measures_;
};

inline constexpr std::string_view kMeasurePrefix = "measure:";
// The feature behind `measure:`. Throws UsageError, which begins with `option` and has near names.
const Feature& measureNamed(const std::string& name, const std::string& option);
// By feature: the values of `cells`; NaN without one. Shows progress. Requires features. Throws as measureCells();
// Interrupted.
std::vector<std::vector<double>> measureValues(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                               const std::vector<const Feature*>& features, unsigned threads);

}  // namespace filiform::tools
