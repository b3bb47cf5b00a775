#include "index/ingest/set_attributes.h"

#include "index/attributes/cell_attributes.h"
#include "index/attributes/internal/attributes_section.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/ingest/growth/internal/amended_revision.h"
#include "index/ingest/internal/make_set.h"
#include "index/set/tile_set.h"
#include "index/text.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace filiform {
namespace {

std::size_t rowOf(const AttributeTable& table, const CellRecord& cell) {
  const std::size_t row = table.find(cell.name);
  if (row != AttributeTable::kNone) return row;
  return mayBeNamedAfter(cell.name, cell.source) ? table.find(cellNames({cell.source}).front()) : AttributeTable::kNone;
}

// Merges the rows into the attributes of cells, and counts.
class Merge {
 public:
  explicit Merge(const AttributeTable& table) : table_(table), used_(table.rows(), false) {
    for (const std::string& name : table.names()) result.columns.push_back({.name = name});
  }

  void add(const CellRecord& cell, std::vector<CellAttribute>& attributes) {
    const std::size_t row = rowOf(table_, cell);
    ++(row == AttributeTable::kNone ? result.without_row : result.with_row);
    if (row == AttributeTable::kNone) return;
    used_[row] = true;
    std::vector<CellAttribute> stated = table_.attributes(row);
    for (SetAttributesResult::Column& column : result.columns) {
      const auto named = [&](const CellAttribute& attribute) { return attribute.name == column.name; };
      const auto now = std::find_if(stated.begin(), stated.end(), named);
      const auto before = std::find_if(attributes.begin(), attributes.end(), named);
      if (now == stated.end()) {
        ++column.empty;
      } else if (before == attributes.end()) {
        ++column.given;
        attributes.push_back(std::move(*now));
      } else if (textOf(before->value) == textOf(now->value)) {
        ++column.same;
        before->value = std::move(now->value);  // perhaps a number instead of its text
      } else {
        if (++column.replaced == 1 && first_conflict_.empty())
          first_conflict_ = "column " + escaped(column.name, 80) + ": cell " + escaped(cell.name, 80) + " has '" +
                            escaped(textOf(before->value), 60) + "' already, and the table says '" +
                            escaped(textOf(now->value), 60) + "'";
        before->value = std::move(now->value);
      }
    }
  }
  void finish() {
    result.rows_without_cell = static_cast<std::uint64_t>(std::count(used_.begin(), used_.end(), false));
  }
  // Of the first value that is replaced.
  const std::string& first_conflict() const { return first_conflict_; }

  SetAttributesResult result;

 private:
  const AttributeTable& table_;
  std::vector<bool> used_;  // by row
  std::string first_conflict_;
};

}  // namespace

SetAttributesResult setAttributes(const AttributeTable& table, const std::string& path, bool replace) {
  if (table.names().empty())
    throw InputError(inShort(table.file()) + ": has no column beside that of the names of cells; nothing to keep");
  internal::SetFolder folder(internal::folderName(path), internal::SetFolder::Purpose::grow);
  const auto base = TileSet::open(path);
  const CellAttributes before(*base);
  Merge merge(table);
  internal::AttributeTable all;
  std::optional<std::uint32_t> first_cell;
  for (std::uint32_t c = 0; c < base->cell_count(); ++c) {
    if (base->cell(c).removed) continue;
    if (!first_cell) first_cell = c;
    std::vector<CellAttribute> attributes = before.of(c);
    merge.add(base->cell(c), attributes);
    all.add(c, attributes);
  }
  merge.finish();
  if (merge.result.with_row == 0)
    throw InputError(inShort(table.file()) + ": no row belongs to a cell of the set" +
                     (table.rows() > 0 && first_cell
                          ? ": the first row is for '" + escaped(table.first_key(), 60) + "', and the first cell is '" +
                                escaped(base->cell(*first_cell).name, 60) + "'; does --key name the right column?"
                          : ""));
  std::uint64_t replaced = 0;
  for (SetAttributesResult::Column& column : merge.result.columns) {
    replaced += column.replaced;
    column.is_new = !before.find(column.name);
  }
  if (replaced > 0 && !replace)
    throw InputError(inShort(table.file()) + ": " + merge.first_conflict() +
                     (replaced > 1 ? "; " + counted(replaced, "value") + " in all" : "") +
                     "; --replace replaces values, or leave the column out");
  const auto types = all.types();
  for (SetAttributesResult::Column& column : merge.result.columns)
    if (const auto type = types.find(column.name); type != types.end()) column.type = type->second;
  merge.result.revision =
      internal::publishAmended(folder, *base, {{internal::kAttributesSection, all.encode(base->cell_count())}});
  merge.result.unchanged = merge.result.revision == base->revision();
  return std::move(merge.result);
}

}  // namespace filiform
