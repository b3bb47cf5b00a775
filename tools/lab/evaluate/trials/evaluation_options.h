// The options of an evaluation. Thread rule: values.
#pragma once

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
  double leap = 1;                   // of climb; see NavigationOptions
  std::vector<std::string> scenes;   // only these scenes are run; empty: the whole evaluation
  bool quick = false;                // run a few of everything, to see that it works; the figures mean little
  // Called about ten times a second. An exception from it ends the evaluation.
  std::function<void(const std::string& stage, std::uint64_t done, std::uint64_t total)> progress;
};

}  // namespace filiform::tools
