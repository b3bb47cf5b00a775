#include "viewer/window/travel/internal/bookmark_file.h"

#include "index/errors.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace filiform::internal {
namespace {

std::string quoted(const std::string& text) {
  if (text.find_first_of(",;\t\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

// Takes the fields of the next row from the text.
std::vector<std::string> takeRow(std::string_view& text, char separator) {
  std::vector<std::string> fields(1);
  bool in_quotes = false;
  std::size_t i = 0;
  for (; i < text.size(); ++i) {
    const char c = text[i];
    if (in_quotes && c == '"' && i + 1 < text.size() && text[i + 1] == '"')
      fields.back() += text[++i];
    else if (c == '"')
      in_quotes = !in_quotes;
    else if (!in_quotes && c == separator)
      fields.emplace_back();
    else if (!in_quotes && c == '\n')
      break;
    else if (c != '\r' || in_quotes)
      fields.back() += c;
  }
  text.remove_prefix(std::min(i + 1, text.size()));
  return fields;
}

std::optional<double> coordinateOf(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  const bool good = !text.empty() && end == text.c_str() + text.size();
  return good && std::abs(number) < Grid::kMaxCoordinate_um ? std::optional(number) : std::nullopt;
}

}  // namespace

std::string bookmarksCsv(const std::vector<BookmarkRow>& rows) {
  std::string text = "name,cell,sample,x_um,y_um,z_um\n";
  for (const BookmarkRow& row : rows)
    text += quoted(row.name) + "," + quoted(row.cell) + "," + (row.sample ? std::to_string(*row.sample) : "") +
            format(",%.4f,%.4f,%.4f\n", row.p_W.x(), row.p_W.y(), row.p_W.z());
  return text;
}

ReadBookmarks readBookmarks(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const std::string_view head = text.substr(0, text.find('\n'));
  const char separator = head.find('\t') != head.npos ? '\t' : head.find(',') != head.npos ? ',' : ';';
  const std::vector<std::string> columns = takeRow(text, separator);
  std::array<std::size_t, 4> places{};
  constexpr std::array kNames{"name", "x_um", "y_um", "z_um"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    places[i] = static_cast<std::size_t>(std::find(columns.begin(), columns.end(), kNames[i]) - columns.begin());
    if (places[i] == columns.size())
      throw UsageError(std::string("bookmarks: the first line has no column ") + kNames[i] +
                       "; it must name name, x_um, y_um and z_um");
  }
  ReadBookmarks read;
  while (!text.empty()) {
    std::vector<std::string> fields = takeRow(text, separator);
    if (fields.size() == 1 && fields[0].empty()) continue;
    fields.resize(std::max(fields.size(), columns.size()));
    const auto x = coordinateOf(fields[places[1]]), y = coordinateOf(fields[places[2]]),
               z = coordinateOf(fields[places[3]]);
    if (!x || !y || !z || fields[places[0]].empty() || read.rows.size() == ReadBookmarks::kMost)
      ++read.left_out;
    else
      read.rows.push_back({.name = fields[places[0]], .cell = {}, .p_W = {*x, *y, *z}});
  }
  return read;
}

}  // namespace filiform::internal
