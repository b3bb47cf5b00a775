// Two runs of `filiform bench`, side by side: how much each figure changed, and whether that is more than its spread.
// Functions without state.
#pragma once

#include "tools/bench/bench.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

// A change for the worse by more than this, and by more than the spread, is a regression.
inline constexpr double kRegression = 0.10;
inline constexpr double kSignificant = 0.05;

struct Comparison {
  std::string workload, name, unit;
  double a = 0, b = 0;  // medians over the batches
  double ratio = 0;     // b / a
  double chance = 1;    // of ranks as far apart as these, if nothing had changed (two-sided); 1: one batch only
  bool regression = false;
};

struct RunComparison {
  std::vector<Comparison> figures;  // of samples that both have, in the order of A
  std::vector<std::string> notes;   // what makes them hard to compare: another machine, size, seed; what one lacks
  std::size_t regressions() const;
};

// The rank-sum test, exact, ties by mean ranks: the chance that a random division of all values into two groups of
// these sizes has rank sums as far apart. 1 where a group is empty. O((n + m)^2 n).
double rankSumChance(const std::vector<double>& a, const std::vector<double>& b);

// Of two files bench.json. Throws IoError for what cannot be read, InputError for what is no such file.
RunComparison compareRuns(const std::string& path_a, const std::string& path_b);

std::string comparisonMarkdown(const RunComparison& comparison);

}  // namespace filiform::tools
