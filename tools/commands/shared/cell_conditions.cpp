#include "tools/commands/shared/cell_conditions.h"

#include "index/measure/set_measures.h"
#include "index/text.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"
#include "tools/words/measure_table.h"

#include <algorithm>
#include <cmath>
#include <thread>

namespace filiform::tools {
namespace {

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

std::vector<std::uint32_t> CellConditions::select(const TileSet& set, const CellAttributes& attributes,
                                                  unsigned threads) const {
  const std::vector<std::uint32_t> cells = attributes_.select(set, attributes);
  if (measures_.empty()) return cells;
  std::vector<const Feature*> features;
  for (const auto& [feature, condition] : measures_) features.push_back(feature);
  const std::vector<std::vector<double>> values = measureValues(set, cells, features, threads);
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
                                               const std::vector<const Feature*>& features, unsigned threads) {
  std::vector<std::vector<double>> values(features.size());
  Progress progress({.title = "measure", .noun = "cells", .total = cells.size()});
  measureCells(store, cells,
               {.measures = {},
                .threads = threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency()),
                .check =
                    [&] {
                      throwIfInterrupted();
                      progress.update(values[0].size());
                    }},
               [&](std::uint32_t, const CellMeasures& m) {
                 for (std::size_t i = 0; i < features.size(); ++i)
                   values[i].push_back(features[i]->value(m.all, &m.soma));
               });
  progress.finish();
  return values;
}

}  // namespace filiform::tools
