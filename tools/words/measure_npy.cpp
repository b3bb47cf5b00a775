#include "tools/words/measure_npy.h"

#include "index/text.h"
#include "tools/words/npy.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {
namespace {

using ValueKind = MeasureTable::Value::Kind;

std::vector<char32_t> lettersOf(const std::string& text) {
  std::vector<char32_t> letters;
  for (std::string_view rest = text; !rest.empty();) {
    const Utf8Character character = decodeUtf8(rest);
    letters.push_back(character.length == 0 ? U'\uFFFD' : character.code_point);
    rest.remove_prefix(std::max<std::size_t>(character.length, 1));
  }
  return letters;
}

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
    std::vector<std::vector<char32_t>> texts;
    std::size_t longest = 1;
    for (const std::string& text : values.texts) {
      texts.push_back(lettersOf(text));
      longest = std::max(longest, texts.back().size());
    }
    bytes = npyHeader("'<U" + std::to_string(longest) + "'", rows_);
    for (std::vector<char32_t>& text : texts) {
      text.resize(longest);
      for (const char32_t letter : text) appendValue(bytes, static_cast<std::uint32_t>(letter));
    }
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
