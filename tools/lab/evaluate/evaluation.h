// `filiform evaluate`: a simulated hand travels scenes and routes with every method; writes tables, plots and one page.
// README.md in this folder explains the measurements. Thread rule: a function without state.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

struct EvaluationOptions {
  std::string out = "filiform-out";  // existing folder
  std::string corpus;                // name of the cells for the report; empty: synthetic cells
  std::uint64_t routes = 0;          // number over all cells; 0: 2000 on a corpus, 24 on synthetic cells
  std::uint64_t seed = 1;            // of the draw of routes, the tremor, the synthetic cells and the pulls
  unsigned threads = 1;
  std::vector<std::string> methods;  // from trialMethods(); empty: all
  std::vector<double> zooms_um;      // of the main tables; empty: 100, 300, 1000
  bool quick = false;                // run a few of everything, to see that it works; the figures mean little
  // Called about ten times a second. An exception from it ends the evaluation.
  std::function<void(const std::string& stage, std::uint64_t done, std::uint64_t total)> progress;
};

// Travels the scenes and the routes drawn on `cells`. Writes evaluate.json, evaluate.md, evaluate.html, trials.csv,
// timings.csv, hold.csv, cells.csv and the plots into the folder. Returns the text for stdout. trials.csv, hold.csv and
// cells.csv have the same bytes for the same cells, options and seed, on any number of threads. Throws UsageError for
// an unknown method or a zoom that is not > 0, InputError if no cell has a route, IoError. Exceptions of the stream
// propagate.
std::string evaluate(CellStream& cells, const EvaluationOptions& options);

}  // namespace filiform::tools
