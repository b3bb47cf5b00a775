#include "tools/words/measure_npy.h"

#include "tools/words/npy.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {
namespace {

using ValueKind = MeasureTable::Value::Kind;

}  // namespace

void MeasureArrays::add(const MeasureTable::Row& row) {
  ++rows_;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    Values& values = values_[i];
    switch (columns_[i].kind) {
      case ValueKind::kText:
        values.texts.push_back(row[i].text);
        break;
      case ValueKind::kCounts:
        values.lists.push_back(row[i].counts);
        break;
      case ValueKind::kCount:
      case ValueKind::kNumber: {
        const bool has_count = columns_[i].kind == ValueKind::kCount && !std::isnan(row[i].number);
        values.numbers.push_back(has_count ? static_cast<double>(row[i].count) : row[i].number);
        values.has_gaps |= std::isnan(row[i].number);
      }
    }
  }
}

std::string MeasureArrays::npy(std::size_t column) const {
  const Values& values = values_[column];
  std::string bytes;
  if (columns_[column].kind == ValueKind::kText) {
    bytes = npyOfTexts(rows_, [&](std::size_t row) -> std::string_view { return values.texts[row]; });
  } else if (columns_[column].kind == ValueKind::kCounts) {
    std::size_t longest = 0;
    for (const auto& list : values.lists) longest = std::max(longest, list.size());
    bytes = npyHeader("'<i8'", rows_, longest);
    for (const auto& list : values.lists)
      for (std::size_t i = 0; i < longest; ++i)
        appendValue(bytes, i < list.size() ? static_cast<std::int64_t>(list[i]) : std::int64_t{0});
  } else {
    const bool is_whole = columns_[column].kind == ValueKind::kCount && !values.has_gaps;
    bytes = npyHeader(is_whole ? "'<i8'" : "'<f8'", rows_);
    for (const double number : values.numbers)
      is_whole ? appendValue(bytes, static_cast<std::int64_t>(number)) : appendValue(bytes, number);
  }
  return bytes;
}

}  // namespace filiform::tools
