#include "index/cell.h"

#include "index/text.h"

#include <algorithm>
#include <string_view>
#include <unordered_map>
#include <unordered_set>

namespace filiform {
namespace {

std::string_view withoutEndings(std::string_view path) {
  for (const std::string_view ending : {".swc", ".cng"}) {
    const std::string_view rest = path.substr(0, path.size() - std::min(path.size(), ending.size()));
    if (endsWithNoCase(path, ending) && !rest.empty() && rest.back() != '/') path = rest;
  }
  return path;
}

// The last `parts` parts of the path, or all of it.
std::string_view suffix(std::string_view path, std::size_t parts) {
  std::size_t slash = path.size();
  while (parts-- > 0) {
    if (slash == 0) return path;
    slash = path.rfind('/', slash - 1);
    if (slash == std::string_view::npos) return path;
  }
  return path.substr(slash + 1);
}

// Gives each of the `open` sources, all different, a name that no other has. `shorten` is what is shown of a suffix.
// Returns the sources that their whole path does not tell apart.
template <class Shorten>
std::vector<std::string_view> tellApart(std::vector<std::string_view> open, Shorten shorten,
                                        std::unordered_map<std::string_view, std::string_view>& names) {
  std::vector<std::string_view> left;
  for (std::size_t parts = 1; !open.empty(); ++parts) {
    std::unordered_map<std::string_view, std::vector<std::string_view>> groups;
    for (const std::string_view source : open) groups[shorten(suffix(source, parts))].push_back(source);
    open.clear();
    for (const auto& [name, group] : groups) {
      const auto is_whole = [&](std::string_view source) { return suffix(source, parts).size() == source.size(); };
      const auto whole = std::count_if(group.begin(), group.end(), is_whole);
      for (const std::string_view source : group) {
        if (group.size() == 1 || (whole == 1 && is_whole(source))) {
          names[source] = name;
        } else {
          (is_whole(source) ? left : open).push_back(source);
        }
      }
    }
  }
  return left;
}

}  // namespace

std::vector<std::string> cellNames(const std::vector<std::string>& sources) {
  const std::unordered_set<std::string_view> different(sources.begin(), sources.end());
  std::unordered_map<std::string_view, std::string_view> short_names;
  const std::vector<std::string_view> left =
      tellApart({different.begin(), different.end()}, withoutEndings, short_names);
  tellApart(
      left, [](std::string_view path) { return path; }, short_names);

  // A name with an ending or a number may still be another's plain name: the later one is then numbered on.
  std::vector<std::string> names;
  names.reserve(sources.size());
  std::unordered_set<std::string> taken;
  std::unordered_map<std::string_view, std::size_t> seen;
  for (const std::string& source : sources) {
    const std::string base(short_names[source]);
    std::size_t number = ++seen[source];
    std::string name = number == 1 ? base : base + "#" + std::to_string(number);
    while (!taken.insert(name).second) name = base + "#" + std::to_string(++number);
    seen[source] = number;
    names.push_back(std::move(name));
  }
  return names;
}

}  // namespace filiform
