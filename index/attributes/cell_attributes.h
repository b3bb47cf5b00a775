// CellAttributes: the attributes that an open tile set keeps beside its cells. Each attribute is a column of one type
// with a value, or none, for each cell. The set's section `attributes` holds them; FORMAT.md specifies its bytes.
//
//   const CellAttributes attributes(*set);
//   if (const auto mtype = attributes.find("mtype")) std::cout << textOf(attributes.value(*mtype, cell)) << '\n';
#pragma once

#include "index/cell/attribute.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

// Thread rule: internally synchronised. Members throw CorruptSet and IoError. The root is read at construction; each
// dictionary and each page of 4096 values is read and checked at its first use, and kept.
class CellAttributes {
 public:
  struct Column {
    std::string name;
    AttributeType type;
    std::uint64_t values = 0;   // cells that have one
    std::uint32_t entries = 0;  // different texts of a text column, else 0
  };

  // `set` must outlive this object. Without the section there are no columns.
  explicit CellAttributes(const TileSet& set);
  ~CellAttributes();

  // Ascending by name, in byte order.
  const std::vector<Column>& columns() const;
  bool empty() const { return columns().empty(); }
  // `attribute:type` names the column `type`, too: for places where `type` alone means something else.
  std::optional<std::uint32_t> find(std::string_view name) const;

  // The value of a cell; missing if the cell has none, or is removed. Requires column < columns().size() and
  // cell < set.cell_count().
  AttributeValue value(std::uint32_t column, std::uint32_t cell) const;
  // All values of a cell that are not missing, by column.
  std::vector<CellAttribute> of(std::uint32_t cell) const;

  // The different texts of a text column, ascending in byte order.
  const std::vector<std::string>& dictionary(std::uint32_t column) const;
  // Whole columns, one value a cell, to colour and select by. O(cells).
  static constexpr std::uint32_t kNoCode = UINT32_MAX;
  std::vector<std::uint32_t> codes(std::uint32_t column) const;  // of a text column: places in dictionary(), or kNoCode
  std::vector<double> numbers(std::uint32_t column) const;       // of other columns; NaN: missing

  // Reads and checks everything. Throws CorruptSet.
  void check() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
