// Runs on small scenes, with the rows of the CSV.
#pragma once

#include "solver/travel/run/run.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace filiform::test {

inline std::unique_ptr<TileStore> column(std::uint32_t capacity = 64) {
  return storeOf(randomColumn(7, 4, 1200, 150), capacity);
}

// A neurite of `samples` samples on a straight line, 2 um apart.
inline Cell line(std::uint32_t samples) {
  Cell cell;
  for (std::uint32_t i = 0; i < samples; ++i) addSample(cell, {2.0 * i, 0, 0}, i == 0 ? kNoParent : i - 1);
  return cell;
}

inline std::unique_ptr<TileStore> straightNeurite(std::uint32_t samples = 60) { return storeOf({line(samples)}, 8); }

struct Recorded {
  RunSummary summary;
  std::vector<std::string> rows;
  std::vector<bool> frontier;
};

inline Recorded record(const TileStore& store, const RunOptions& options) {
  Recorded recorded;
  recorded.summary = run(store, options, [&](const TickRow& row) {
    std::ostringstream line;
    writeCsvRow(line, row);
    recorded.rows.push_back(line.str());
    recorded.frontier.push_back(row.frontier);
  });
  return recorded;
}

inline RunOptions shortRun() {
  RunOptions options;
  options.route = routeChoiceOf("random:3");
  options.zoom_um = 100;
  options.seconds = 6;
  return options;
}

}  // namespace filiform::test
