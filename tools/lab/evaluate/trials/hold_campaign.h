// Runs series of hold tests: the same random pulls with every method, several hands and zooms. Function without state.
#pragma once

#include "tools/lab/evaluate/trials/hold.h"
#include "tools/lab/evaluate/trials/trial_corpus.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

struct HoldSeries {  // one method under one hand
  std::string method, hand;
  double stiffness_N_m, zoom_um;
  std::vector<HoldResult> results;  // one a pull
};

struct HoldOptions {
  std::vector<std::string> methods;  // from trialMethods()
  std::uint64_t seed = 1;            // of the places and pulls
  unsigned threads = 1;
  bool quick = false;  // 4 pulls instead of 300
  // Called about ten times a second on the caller's thread. An exception from it ends the campaign.
  std::function<void(std::uint64_t groups)> progress;
};

// The results are the same for the same cells, methods and seed, on any number of threads. Requires at least one cell.
std::vector<HoldSeries> runHolds(const std::vector<CorpusCell>& cells, const HoldOptions& options);

}  // namespace filiform::tools
