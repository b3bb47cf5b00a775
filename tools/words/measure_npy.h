// The rows of `measure` as arrays of NumPy, one a column. Thread rule: thread-compatible.
#pragma once

#include "tools/words/measure_table.h"

#include <cstddef>
#include <string>
#include <vector>

namespace filiform::tools {

class MeasureArrays {
 public:
  explicit MeasureArrays(std::vector<MeasureTable::Column> columns)
      : columns_(std::move(columns)), values_(columns_.size()) {}
  void add(const MeasureTable::Row& row);
  std::size_t rows() const { return rows_; }
  // The column as a file .npy: int64 for counts without gaps, float64 with NaN for other numbers, UCS-4 for texts; for
  // lists of counts a table, as wide as the longest list, with 0 behind shorter lists.
  std::string npy(std::size_t column) const;

 private:
  struct Values {
    std::vector<double> numbers;  // counts below 2^53 too
    std::vector<std::string> texts;
    std::vector<std::vector<std::uint64_t>> lists;
    bool has_gaps = false;
  };
  std::vector<MeasureTable::Column> columns_;
  std::vector<Values> values_;
  std::size_t rows_ = 0;
};

}  // namespace filiform::tools
