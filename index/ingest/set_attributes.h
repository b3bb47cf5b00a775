// setAttributes: gives the cells of an existing set the attributes of a table.
#pragma once

#include "index/circuits/attribute_table.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform {

struct SetAttributesResult {
  struct Column {
    std::string name;
    AttributeType type = AttributeType::text;  // that the set now has
    bool is_new = false;
    // Cells with a row: without a value before, with another value before, with the same value, with an empty field.
    std::uint64_t given = 0, replaced = 0, same = 0, empty = 0;
  };
  std::vector<Column> columns;                                         // of the table, in its order
  std::uint64_t with_row = 0, without_row = 0, rows_without_cell = 0;  // cells, rows
  std::string revision;
  bool unchanged = false;  // nothing was published
};

// A row belongs to the cell of its name; if there is none, to the cells whose names were made from a source of this
// base name, as in ingest(). Columns and cells that the table does not name keep their values, and so does a cell whose
// field is empty. A column that holds numbers and texts in the end is one of texts. Publishes a new revision as
// ingest() does: at once, and a failure leaves the set unchanged. Tiles are neither read nor written, and levels of
// detail stay.
//
// Without `replace`, throws InputError if a cell has another value already; the message names the column and the first
// such cell. Throws InputError if no row belongs to a cell or the table has no column but the key, and what
// addCells() throws. Takes memory for all attributes of the set. O(cells * columns).
SetAttributesResult setAttributes(const AttributeTable& table, const std::string& path, bool replace = false);

}  // namespace filiform
