#include "tools/commands/shared/cell_conditions.h"

#include "tools/program/interruption.h"
#include "tools/program/progress.h"

#include <algorithm>
#include <optional>
#include <thread>

namespace filiform::tools {
namespace {

// Calls measure(threads, check).
template <class Measure>
auto withProgress(unsigned threads, const Measure& measure) {
  std::optional<Progress> progress;
  const auto found =
      measure(threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency()),
              [&](const std::vector<std::uint32_t>& cells, std::size_t done) {
                throwIfInterrupted();
                if (!progress)
                  progress.emplace(ProgressOptions{.title = "measure", .noun = "cells", .total = cells.size()});
                progress->update(done);
              });
  if (progress) progress->finish();
  return found;
}

}  // namespace

std::vector<std::uint32_t> cellsMeeting(const CellConditions& conditions, const TileSet& set,
                                        const CellAttributes& attributes, unsigned threads) {
  return withProgress(threads, [&](unsigned n, const MeasureCheck& check) {
    return conditions.select(set, set, attributes, n, check);
  });
}

std::vector<std::vector<double>> valuesOf(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                          const std::vector<const Feature*>& features, unsigned threads) {
  return withProgress(
      threads, [&](unsigned n, const MeasureCheck& check) { return measureValues(store, cells, features, n, check); });
}

}  // namespace filiform::tools
