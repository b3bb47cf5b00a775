#include "index/formats/internal/catmaid_columns.h"

#include "index/formats/swc/internal/swc_fields.h"
#include "index/text.h"

#include <algorithm>
#include <initializer_list>

namespace filiform::internal {
namespace {

std::string_view withoutOuterBlanks(std::string_view text) {
  while (!text.empty() && (isBlank(text.front()) || text.front() == '\r')) text.remove_prefix(1);
  while (!text.empty() && (isBlank(text.back()) || text.back() == '\r')) text.remove_suffix(1);
  return text;
}

}  // namespace

void splitRow(std::string_view line, char separator, std::vector<std::string_view>& values) {
  values.clear();
  for (;;) {
    std::size_t end = line.find(separator);
    std::string_view value = withoutOuterBlanks(line.substr(0, end));
    if (value.starts_with('"')) {
      const std::size_t begin = line.find('"') + 1, close = line.find('"', begin);
      value = withoutOuterBlanks(line.substr(begin, close == std::string_view::npos ? close : close - begin));
      end = close == std::string_view::npos ? close : line.find(separator, close);
    }
    values.push_back(value);
    if (end == std::string_view::npos) return;
    line.remove_prefix(end + 1);
  }
}

CatmaidColumns CatmaidColumns::of(std::string_view header) {
  CatmaidColumns columns;
  if (header.starts_with("\xEF\xBB\xBF")) header.remove_prefix(3);
  for (const char separator : {';', '\t'})
    if (header.find(',') == std::string_view::npos && header.find(separator) != std::string_view::npos)
      columns.separator = separator;
  std::vector<std::string_view> names;
  splitRow(header, columns.separator, names);
  for (std::size_t place = 0; place < names.size(); ++place) {
    const std::string name = lowerCase(names[place]);
    const auto take = [&](std::size_t& column, std::initializer_list<std::string_view> known) {
      if (column == kNone && std::find(known.begin(), known.end(), name) != known.end()) column = place;
    };
    take(columns.skeleton, {"skeleton_id"});
    take(columns.node, {"treenode_id"});
    take(columns.parent, {"parent_treenode_id", "parent_id"});
    take(columns.x, {"x"});
    take(columns.y, {"y"});
    take(columns.z, {"z"});
    take(columns.radius, {"r", "radius"});
  }
  return columns;
}

std::string CatmaidColumns::missing() const {
  std::string names;
  const auto need = [&](std::size_t column, const char* name) {
    if (column == kNone) names += (names.empty() ? "" : ", ") + std::string(name);
  };
  need(skeleton, "skeleton_id");
  need(node, "treenode_id");
  need(parent, "parent_treenode_id");
  need(x, "x");
  need(y, "y");
  need(z, "z");
  return names;
}

}  // namespace filiform::internal
