#include "tools/words/filter_words.h"

#include "index/errors.h"
#include "index/measure/set_measures.h"
#include "index/text.h"
#include "tools/words/measure_table.h"
#include "tools/words/near_names.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

namespace filiform::tools {
namespace {

constexpr std::uint16_t kBasalType = 3, kApicalType = 4;

bool isOfMeasure(const std::string& condition) {
  const std::size_t begin = condition.find_first_not_of(' ');
  return begin != std::string::npos && condition.compare(begin, kMeasurePrefix.size(), kMeasurePrefix) == 0;
}

std::vector<std::string> onMeasures(const std::vector<std::string>& where, bool wanted) {
  std::vector<std::string> found;
  for (const std::string& condition : where)
    if (isOfMeasure(condition) == wanted) found.push_back(condition);
  return found;
}

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

const Feature& measureNamed(const std::string& name, const std::string& option) {
  const auto found = parseFeatures(name, option);
  if (found.size() != 1) throw UsageError(option + ": give one feature, such as measure:length");
  return *found[0];
}

CellConditions::CellConditions(const std::vector<std::string>& where) : attributes_(onMeasures(where, false)) {
  const AttributeConditions measures(onMeasures(where, true));
  for (const AttributeConditions::Condition& condition : measures.all())
    measures_.emplace_back(
        &measureNamed(condition.name.substr(kMeasurePrefix.size()), "--where " + inShort(condition.whole)), condition);
}

std::vector<std::uint32_t> CellConditions::select(const TileSet& set, const TileStore& store,
                                                  const CellAttributes& attributes, unsigned threads,
                                                  const MeasureCheck& check) const {
  const std::vector<std::uint32_t> cells = attributes_.select(set, attributes);
  if (measures_.empty()) return cells;
  std::vector<const Feature*> features;
  for (const auto& [feature, condition] : measures_) features.push_back(feature);
  const std::vector<std::vector<double>> values = measureValues(store, cells, features, threads, check);
  std::vector<std::uint32_t> met;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    bool all = true;
    for (std::size_t c = 0; c < measures_.size(); ++c)
      all =
          all && measures_[c].second.meets(std::isnan(values[c][i]) ? AttributeValue() : AttributeValue(values[c][i]));
    if (all) met.push_back(cells[i]);
  }
  return met;
}

std::vector<std::vector<double>> measureValues(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                               const std::vector<const Feature*>& features, unsigned threads,
                                               const MeasureCheck& check) {
  std::vector<std::vector<double>> values(features.size());
  measureCells(store, cells, {.measures = {}, .threads = threads, .check = [&] { check(cells, values[0].size()); }},
               [&](std::uint32_t, const CellMeasures& m) {
                 for (std::size_t i = 0; i < features.size(); ++i)
                   values[i].push_back(features[i]->value(m.all, &m.soma));
               });
  return values;
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
