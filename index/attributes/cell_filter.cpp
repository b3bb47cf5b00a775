#include "index/attributes/cell_filter.h"

#include "index/errors.h"
#include "index/text.h"

#include <cstdint>

namespace filiform {

std::string unknownAttribute(const std::string& name, const CellAttributes& attributes) {
  if (attributes.empty()) return "the set has no attributes of cells, so none named " + escaped(name, 80);
  std::string all;
  for (const CellAttributes::Column& column : attributes.columns())
    all += (all.empty() ? "" : ", ") + escaped(column.name, 80);
  return "the cells have no attribute " + escaped(name, 80) + "; the attributes are " + escaped(all, 600);
}

std::vector<std::uint32_t> CellFilter::select(const TileSet& set, const CellAttributes& attributes) const {
  std::vector<bool> chosen(set.cell_count(), true);
  for (const AttributeConditions::Condition& condition : conditions_.all()) {
    const auto column = attributes.find(condition.name);
    if (!column) condition.refuseName(unknownAttribute(condition.name, attributes));
    if (attributes.columns()[*column].type == AttributeType::text) {
      if (condition.ofOrder()) condition.refuseText();
      const bool missing_meets = condition.meets({});
      std::vector<bool> of_code;
      for (const std::string& entry : attributes.dictionary(*column)) of_code.push_back(condition.meets(entry));
      const std::vector<std::uint32_t> codes = attributes.codes(*column);
      for (std::size_t i = 0; i < chosen.size(); ++i)
        chosen[i] = chosen[i] && (codes[i] == CellAttributes::kNoCode ? missing_meets : of_code[codes[i]]);
    } else {
      for (std::uint32_t i = 0; i < chosen.size(); ++i)
        chosen[i] = chosen[i] && condition.meets(attributes.value(*column, i));
    }
  }
  std::vector<std::uint32_t> cells;
  for (std::uint32_t i = 0; i < chosen.size(); ++i)
    if (chosen[i] && !set.cell(i).removed) cells.push_back(i);
  return cells;
}

}  // namespace filiform
