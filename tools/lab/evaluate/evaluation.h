// `filiform evaluate`: scenes and routes travelled by a simulated hand with every method; tables, plots and one page.
// README.md of this folder says what is measured and how to read it. Thread rule: a function without state.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

struct EvaluationOptions {
  std::string out = "filiform-out";  // folder; exists
  std::string corpus;                // for the report: what the cells are; empty: synthetic
  std::uint64_t routes = 0;          // drawn over all cells; 0: 2000 of a corpus, 24 of synthetic cells
  std::uint64_t seed = 1;            // of the draw of routes, the tremor, the synthetic cells and the pulls
  unsigned threads = 1;
  std::vector<std::string> methods;  // of trialMethods(); empty: all
  std::vector<double> zooms_um;      // of the main tables; empty: 100, 300, 1000
  bool quick = false;                // a few of everything, to see that it works: figures mean little
  // Told about ten times a second. What it throws ends the evaluation.
  std::function<void(const std::string& stage, std::uint64_t done, std::uint64_t total)> progress;
};

// Travels the scenes and the routes drawn on `cells`, and writes evaluate.json, evaluate.md, evaluate.html, trials.csv,
// timings.csv, hold.csv, cells.csv and the plots into the folder. Returns what stdout shall say. trials.csv, hold.csv
// and cells.csv have the same bytes for the same cells, options and seed, whatever the threads. Throws UsageError for
// an unknown method or a zoom that is not > 0, InputError where no cell has a route, IoError, and what the stream
// throws.
std::string evaluate(CellStream& cells, const EvaluationOptions& options);

}  // namespace filiform::tools
