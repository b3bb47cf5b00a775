#include "index/cell/cell.h"

#include "index/text.h"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace filiform {
namespace {

std::string_view withoutEndings(std::string_view path) {
  const auto without = [&](std::string_view ending) {
    const std::string_view rest = path.substr(0, path.size() - std::min(path.size(), ending.size()));
    if (!endsWithNoCase(path, ending) || rest.empty() || rest.back() == '/') return false;
    path = rest;
    return true;
  };
  without(".gz");
  for (const std::string_view ending : {".swc", ".eswc", ".swc.txt", ".edges", ".obj", ".vtk", ".h5", ".asc"})
    if (without(ending)) break;
  without(".cng");
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

// Gives each of the `open` sources, all different, a unique name. `shorten` maps a suffix to the name shown. Returns
// the sources that their whole path does not distinguish.
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

std::uint64_t Cell::line(std::uint32_t rank) const {
  const auto after = std::upper_bound(line_runs.begin(), line_runs.end(), rank,
                                      [](std::uint32_t r, const LineRun& run) { return r < run.rank; });
  if (after == line_runs.begin()) return 0;
  return std::prev(after)->line + (rank - std::prev(after)->rank);
}

void Cell::clearSamples() {
  sample_ids.clear();
  positions_um.clear();
  parents.clear();
  links.clear();
  radii_um.clear();
  types.clear();
  block_starts.clear();
  odd_radii.clear();
  line_runs.clear();
  header.clear();
}

void Cell::discardLarge() {
  if (std::max({sample_ids.capacity(), positions_um.capacity(), parents.capacity(), links.capacity(),
                radii_um.capacity(), types.capacity(), block_starts.capacity(), odd_radii.capacity()}) <=
      2 * kSamplesKept)
    return;
  sample_ids = {};
  positions_um = {};
  parents = {};
  links = {};
  radii_um = {};
  types = {};
  block_starts = {};
  odd_radii = {};
}

std::vector<std::int64_t> distinctIds(std::vector<std::int64_t> ids, const std::vector<std::uint32_t>& block_starts) {
  std::int64_t highest = INT64_MIN;
  for (std::size_t block = 0; block <= block_starts.size(); ++block) {
    const std::size_t begin = block == 0 ? 0 : block_starts[block - 1];
    const std::size_t end = block == block_starts.size() ? ids.size() : block_starts[block];
    if (begin == end) continue;
    const auto [least, most] = std::minmax_element(ids.begin() + static_cast<std::ptrdiff_t>(begin),
                                                   ids.begin() + static_cast<std::ptrdiff_t>(end));
    std::int64_t shift = 0, top = *most;
    if (block > 0 && *least <= highest) {
      if (__builtin_sub_overflow(highest, *least, &shift) || __builtin_add_overflow(shift, 1, &shift) ||
          __builtin_add_overflow(*most, shift, &top)) {
        for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i) + 1;
        return ids;
      }
      for (std::size_t i = begin; i < end; ++i) ids[i] += shift;
    }
    highest = std::max(highest, top);
  }
  return ids;
}

std::vector<std::string> cellNames(const std::vector<std::string>& sources, const std::vector<std::string>& given) {
  const auto has_name = [&](std::size_t i) { return !given.empty() && !given[i].empty(); };
  std::unordered_set<std::string_view> different;
  std::unordered_set<std::string> taken;
  std::vector<std::string> names(sources.size());
  std::unordered_map<std::string_view, std::size_t> numbers;  // last number used, by the text it was appended to
  const auto number_on = [&](std::size_t i, std::string_view counted, const std::string& base) {
    std::size_t& number = numbers[counted];
    for (;;) {
      names[i] = ++number == 1 ? base : base + "#" + std::to_string(number);
      if (taken.insert(names[i]).second) return;
    }
  };
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!has_name(i)) {
      different.insert(sources[i]);
    } else if (taken.insert(given[i]).second) {
      names[i] = given[i];
    }
  }
  for (std::size_t i = 0; i < sources.size(); ++i)
    if (has_name(i) && names[i].empty()) number_on(i, given[i], given[i]);

  std::unordered_map<std::string_view, std::string_view> short_names;
  const std::vector<std::string_view> left =
      tellApart({different.begin(), different.end()}, withoutEndings, short_names);
  tellApart(
      left, [](std::string_view path) { return path; }, short_names);
  // A name with an ending or a number may equal another plain name: the later one gets a number.
  numbers.clear();
  for (std::size_t i = 0; i < sources.size(); ++i)
    if (!has_name(i)) number_on(i, sources[i], std::string(short_names[sources[i]]));
  return names;
}

bool mayBeNamedAfter(std::string_view name, const std::string& source) {
  const auto ends = [](std::string_view path, std::string_view end) {
    return path.ends_with(end) && !end.empty() &&
           (path.size() == end.size() || path[path.size() - end.size() - 1] == '/');
  };
  if (ends(source, name) || ends(withoutEndings(source), name)) return true;
  const std::size_t number = name.rfind('#');
  return number != std::string_view::npos &&
         name.find_first_not_of("0123456789", number + 1) == std::string_view::npos &&
         mayBeNamedAfter(name.substr(0, number), source);
}

}  // namespace filiform
