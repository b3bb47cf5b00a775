// A table of attributes of cells, as databases write it: CSV or TSV, one row a cell, with a column of names.
//
// A row belongs to the cells whose name is the text of the key column: the name given to the cell, or the base name of
// its source without ending and `.CNG`. Rows without a cell and cells without a row are counted. Fields may be quoted;
// quoted fields may hold separators, quotes (doubled) and line ends. Thread rule: values, thread-compatible.
#pragma once

#include "index/cell/attribute.h"
#include "index/cell/cell.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace filiform {

class AttributeTable {
 public:
  static constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;

  // Reads the table at `path`. The separator is the tab if the header has one, else the comma, else the semicolon.
  // Throws IoError, and InputError `table:line: what` for a header without the column `key` or with a name twice, a row
  // with more fields than the header, a quote that is not closed, text that is not UTF-8, or a larger file.
  static AttributeTable read(const std::string& path, const std::string& key);
  // The same for a text in memory.
  static AttributeTable parse(std::string_view text, const std::string& file, const std::string& key);

  const std::string& file() const { return file_; }
  // Names of the attributes: the columns other than the key, without those of an empty name.
  const std::vector<std::string>& names() const { return names_; }
  std::uint64_t rows() const { return rows_.size(); }
  const std::string& first_key() const { return first_key_; }  // of the first row; empty without rows
  std::uint64_t repeated() const { return repeated_; }         // rows whose key came before; the first one counts
  // Row of a cell's name; kNone if there is none.
  static constexpr std::size_t kNone = SIZE_MAX;
  std::size_t find(std::string_view cell_name) const;
  // The attributes of a row that are not empty. A column has numbers only if all its fields are numbers; else all its
  // values are the text of the fields.
  std::vector<CellAttribute> attributes(std::size_t row) const;
  // Memory, bytes.
  std::uint64_t held_bytes() const;

 private:
  std::string file_, first_key_;
  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> rows_;  // by name
  std::vector<FieldKinds> kinds_;               // by name
  std::unordered_map<std::string, std::size_t> by_key_;
  std::uint64_t repeated_ = 0;
};

// The cells of a stream, with the attributes of a table. Both must outlive it. Thread rule: as CellStream.
class AttributedCells final : public CellStream {
 public:
  AttributedCells(CellStream& cells, const AttributeTable& table);

  // Attributes that a cell has already stay unless the table has the same name.
  bool next(Cell& cell) override;

  const AttributeTable& table() const { return table_; }
  // Of the first pass, complete once next() has returned false.
  std::uint64_t with_row() const { return with_row_; }
  std::uint64_t without_row() const { return without_row_; }
  std::uint64_t rows_without_cell() const;
  const std::string& first_cell() const { return first_cell_; }  // its name

  // For several processes that read parts of one stream: what this one has counted. takeCounts() replaces the counts by
  // those of all parts, in the order of the stream.
  std::vector<std::uint8_t> encodeCounts() const;
  void takeCounts(const std::vector<std::vector<std::uint8_t>>& parts);

 private:
  CellStream& cells_;
  const AttributeTable& table_;
  std::vector<bool> used_;  // by row
  std::uint64_t with_row_ = 0, without_row_ = 0;
  std::string first_cell_;
  bool complete_ = false;
};

}  // namespace filiform
