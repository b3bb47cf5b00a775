// The rows of `measure` as arrays of NumPy, one a column. Values wait in an unnamed file. Thread rule:
// thread-compatible.
#pragma once

#include "index/export/column_spool.h"
#include "tools/words/measure_table.h"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

class MeasureArrays {
 public:
  explicit MeasureArrays(std::vector<MeasureTable::Column> columns);
  // Throws IoError.
  void add(const MeasureTable::Row& row);
  std::size_t rows() const { return rows_; }
  // The column as a file .npy: int64 for counts without gaps, float64 with NaN for other numbers, UCS-4 for texts; for
  // lists of counts a table, as wide as the longest list, with 0 behind shorter lists.
  // Its bytes, and one part after the other, at last an empty one; add() may not follow. Parts throw IoError.
  std::uint64_t bytes(std::size_t column) const;
  std::function<std::string()> parts(std::size_t column) const;
  std::string npy(std::size_t column) const;  // the parts together

 private:
  std::string header(std::size_t column) const;
  std::size_t width(std::size_t column) const;  // bytes a row

  std::vector<MeasureTable::Column> columns_;
  ColumnSpool spool_;  // numbers; lengths, then texts or counts
  std::vector<bool> has_gaps_;
  std::vector<std::size_t> longest_;  // text, in letters, or list
  std::size_t rows_ = 0;
};

}  // namespace filiform::tools
