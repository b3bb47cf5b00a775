#include "tools/words/measure_npy.h"

#include "tools/words/npy.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

namespace filiform::tools {
namespace {

using ValueKind = MeasureTable::Value::Kind;

// Reads a column of a spool value by value.
class ColumnReader {
 public:
  ColumnReader(const ColumnSpool& spool, std::size_t column) : spool_(spool), column_(column) {}
  void read(void* to, std::size_t count) {
    for (char* out = static_cast<char*>(to); count > 0;) {
      if (at_ == part_.size()) part_ = spool_.part(column_, next_++), at_ = 0;
      const std::size_t some = std::min(count, part_.size() - at_);
      std::memcpy(out, part_.data() + at_, some);
      out += some, at_ += some, count -= some;
    }
  }
  template <class Value>
  Value next() {
    Value value{};
    read(&value, sizeof value);
    return value;
  }

 private:
  const ColumnSpool& spool_;
  const std::size_t column_;
  std::string part_;
  std::size_t at_ = 0, next_ = 0;
};

}  // namespace

MeasureArrays::MeasureArrays(std::vector<MeasureTable::Column> columns)
    : columns_(std::move(columns)),
      spool_(columns_.size(), "the columns of measures"),
      has_gaps_(columns_.size()),
      longest_(columns_.size()) {}

void MeasureArrays::add(const MeasureTable::Row& row) {
  ++rows_;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i].kind == ValueKind::kText) {
      const std::uint64_t bytes = row[i].text.size();
      spool_.append(i, &bytes, sizeof bytes);
      spool_.append(i, row[i].text.data(), bytes);
      longest_[i] = std::max(longest_[i], letterCount(row[i].text));
    } else if (columns_[i].kind == ValueKind::kCounts) {
      const std::uint64_t count = row[i].counts.size();
      spool_.append(i, &count, sizeof count);
      spool_.append(i, row[i].counts.data(), count * sizeof(std::uint64_t));
      longest_[i] = std::max(longest_[i], row[i].counts.size());
    } else {  // counts are below 2^53
      const bool has_count = columns_[i].kind == ValueKind::kCount && !std::isnan(row[i].number);
      const double number = has_count ? static_cast<double>(row[i].count) : row[i].number;
      spool_.append(i, &number, sizeof number);
      if (std::isnan(number)) has_gaps_[i] = true;
    }
  }
}

std::string MeasureArrays::header(std::size_t column) const {
  const ValueKind kind = columns_[column].kind;
  if (kind == ValueKind::kText)
    return npyHeader("'<U" + std::to_string(std::max<std::size_t>(longest_[column], 1)) + "'", rows_);
  if (kind == ValueKind::kCounts) return npyHeader("'<i8'", rows_, longest_[column]);
  return npyHeader(kind == ValueKind::kCount && !has_gaps_[column] ? "'<i8'" : "'<f8'", rows_);
}

std::size_t MeasureArrays::width(std::size_t column) const {
  const ValueKind kind = columns_[column].kind;
  if (kind == ValueKind::kText) return std::max<std::size_t>(longest_[column], 1) * sizeof(std::uint32_t);
  return kind == ValueKind::kCounts ? longest_[column] * sizeof(std::int64_t) : sizeof(double);
}

std::uint64_t MeasureArrays::bytes(std::size_t column) const { return header(column).size() + rows_ * width(column); }

std::function<std::string()> MeasureArrays::parts(std::size_t column) const {
  constexpr std::size_t kBytes = 65536;
  const auto reader = std::make_shared<ColumnReader>(spool_, column);
  const ValueKind kind = columns_[column].kind;
  const bool is_whole = kind == ValueKind::kCount && !has_gaps_[column];
  return [this, reader, column, kind, is_whole, left = rows_, begun = false]() mutable {
    std::string part = std::exchange(begun, true) ? std::string() : header(column);
    for (; left > 0 && part.size() < kBytes; --left) {
      const std::size_t end = part.size() + width(column);
      if (kind == ValueKind::kText) {
        std::string text(reader->next<std::uint64_t>(), '\0');
        reader->read(text.data(), text.size());
        appendLetters(part, text, longest_[column]);
      } else if (kind == ValueKind::kCounts) {
        for (std::uint64_t count = reader->next<std::uint64_t>(); count > 0; --count)
          appendValue(part, reader->next<std::uint64_t>());
      } else {
        const double number = reader->next<double>();
        is_whole ? appendValue(part, static_cast<std::int64_t>(number)) : appendValue(part, number);
      }
      part.resize(end);
    }
    return part;
  };
}

std::string MeasureArrays::npy(std::size_t column) const {
  std::string bytes;
  const auto next = parts(column);
  for (std::string part = next(); !part.empty(); part = next()) bytes += part;
  return bytes;
}

}  // namespace filiform::tools
