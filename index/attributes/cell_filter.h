// CellFilter: selects cells by their attributes, as `--where` of the commands does.
//
//   const CellFilter filter({"mtype=L5_*", "layer>=4"});
//   for (std::uint32_t cell : filter.select(*set, attributes)) std::cout << set->cell(cell).name << '\n';
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/cell/attribute_conditions.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform {

// Thread rule: immutable once made.
class CellFilter {
 public:
  // The conditions are those of attribute_conditions.h. Throws UsageError for one of another form.
  explicit CellFilter(const std::vector<std::string>& conditions) : conditions_(conditions) {}
  bool empty() const { return conditions_.empty(); }

  // The ids of all cells that meet the conditions, ascending. Removed cells never do. Throws UsageError for an unknown
  // attribute (the message lists the attributes) or for < and > on a column of text. O(cells), and reading the columns.
  std::vector<std::uint32_t> select(const TileSet& set, const CellAttributes& attributes) const;

 private:
  AttributeConditions conditions_;
};

// A message for an attribute that the set does not have; it lists those that it has.
std::string unknownAttribute(const std::string& name, const CellAttributes& attributes);

}  // namespace filiform
