// What users say of the cells and segments that a search or a table considers. Thread rule: values.
#pragma once

#include "index/attributes/cell_filter.h"
#include "index/measure/measures.h"
#include "index/query/segment_filter.h"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace filiform::tools {

// Types: words with `separator` between, ascending; empty for `any`. Throws UsageError, which names `option` and near
// names.
std::vector<std::uint16_t> parseSegmentTypes(const std::string& words, char separator, const std::string& option);

// `axon,dendrite`: the types of two sides, each as parseSegmentTypes() reads it with + between; one side stands for
// both. An empty text: all types. Throws UsageError as it does.
std::array<std::vector<std::uint16_t>, 2> parseTypesOfSides(const std::string& text, const std::string& option);

struct FilterParts {
  std::vector<std::uint32_t> cells{};               // empty: all; in any order, also in `not_cells`
  std::vector<std::uint32_t> not_cells{};           // these are left out
  std::optional<std::vector<std::uint32_t>> met{};  // the cells that meet conditions, ascending; nullopt: all
  std::vector<std::uint16_t> types{};               // empty: all
};

inline constexpr std::string_view kMeasurePrefix = "measure:";
// The feature behind `measure:`. Throws UsageError, which begins with `option` and has near names.
const Feature& measureNamed(const std::string& name, const std::string& option);
// Called before cells are measured, and again and again, with the number that is done; its exceptions propagate.
using MeasureCheck = std::function<void(const std::vector<std::uint32_t>& cells, std::size_t done)>;
// By feature: the values of `cells`; NaN without one. Requires features. Throws as measureCells().
std::vector<std::vector<double>> measureValues(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                               const std::vector<const Feature*>& features, unsigned threads,
                                               const MeasureCheck& check);

// The conditions of --where: on attributes, and on measures: `measure:length>5000`. All must hold.
class CellConditions {
 public:
  // Throws UsageError for a condition of another form, and for an unknown feature, with near names.
  explicit CellConditions(const std::vector<std::string>& where);
  bool empty() const { return attributes_.empty() && measures_.empty(); }

  // The ids of all cells that meet the conditions, ascending. Removed cells never do. Measures the cells that meet the
  // others, in `store`, if there are conditions on measures. Throws as CellFilter::select() and measureCells().
  std::vector<std::uint32_t> select(const TileSet& set, const TileStore& store, const CellAttributes& attributes,
                                    unsigned threads, const MeasureCheck& check) const;

 private:
  CellFilter attributes_;
  std::vector<std::pair<const Feature*, AttributeConditions::Condition>> measures_;
};

// What meets all parts. `cell_count`: of the set. O(cells) if cells are left out.
SegmentFilter filterOf(std::uint32_t cell_count, FilterParts parts);

}  // namespace filiform::tools
