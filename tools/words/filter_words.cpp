#include "tools/words/filter_words.h"

#include "index/errors.h"
#include "index/measure/cell_measures.h"
#include "index/text.h"
#include "tools/words/near_names.h"

#include <algorithm>
#include <numeric>
#include <set>
#include <utility>

namespace filiform::tools {
namespace {

constexpr std::uint16_t kBasalType = 3, kApicalType = 4;

}  // namespace

std::vector<std::uint16_t> parseSegmentTypes(const std::string& words, char separator, const std::string& option) {
  std::set<std::uint16_t> types;
  bool any = false;
  for (std::size_t begin = 0; begin <= words.size();) {
    const std::size_t end = std::min(words.find(separator, begin), words.size());
    const std::string word = words.substr(begin, end - begin);
    begin = end + 1;
    if (word == "any") {
      any = true;
    } else if (word == "dendrite") {
      types.insert({kBasalType, kApicalType});
    } else if (const auto type = neuriteType(word)) {
      types.insert(*type);
    } else {
      NearNames near(word);
      for (const std::string_view name : neuriteTypeNames()) near.offer(std::string(name));
      near.offer("dendrite");
      near.offer("any");
      throw UsageError(option + " '" + escaped(word, 80) +
                       "': give axon, dendrite, basal, apical, soma, undefined, any or a code of SWC" +
                       didYouMean(near.names()));
    }
  }
  if (any) return {};
  return {types.begin(), types.end()};
}

std::array<std::vector<std::uint16_t>, 2> parseTypesOfSides(const std::string& text, const std::string& option) {
  if (text.empty()) return {};
  const std::size_t comma = text.find(',');
  std::vector<std::uint16_t> from = parseSegmentTypes(text.substr(0, comma), '+', option);
  if (comma == std::string::npos) return {from, from};
  return {std::move(from), parseSegmentTypes(text.substr(comma + 1), '+', option)};
}

SegmentFilter filterOf(std::uint32_t cell_count, FilterParts parts) {
  SegmentFilter filter{std::move(parts.met), std::move(parts.types)};
  for (auto* list : {&parts.cells, &parts.not_cells}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  const auto has = [](const std::vector<std::uint32_t>& list, std::uint32_t cell) {
    return std::binary_search(list.begin(), list.end(), cell);
  };
  if (!filter.cells && !parts.cells.empty()) {
    filter.cells = parts.cells;
  } else if (!filter.cells && !parts.not_cells.empty()) {
    filter.cells.emplace(cell_count);
    std::iota(filter.cells->begin(), filter.cells->end(), 0);
  }
  if (filter.cells)
    std::erase_if(*filter.cells, [&](std::uint32_t cell) {
      return has(parts.not_cells, cell) || (!parts.cells.empty() && !has(parts.cells, cell));
    });
  return filter;
}

}  // namespace filiform::tools
