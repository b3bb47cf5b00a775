// `filiform evaluate`: a simulated hand travels scenes and routes with every method; writes tables, plots and one page.
// README.md in this folder explains the measurements. Thread rule: a function without state.
#pragma once

#include "index/cell/cell.h"
#include "tools/lab/evaluate/trials/evaluation_options.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

// Travels the scenes and the routes drawn on `cells`. Writes evaluate.json, evaluate.md, evaluate.html, trials.csv,
// timings.csv, hold.csv, cells.csv and the plots into the folder. Returns the text for stdout. trials.csv, hold.csv and
// cells.csv have the same bytes for the same cells, options and seed, on any number of threads. Throws UsageError for
// an unknown method or a zoom that is not > 0, InputError if no cell has a route, IoError. Exceptions of the stream
// propagate.
std::string evaluate(CellStream& cells, const EvaluationOptions& options);

}  // namespace filiform::tools
