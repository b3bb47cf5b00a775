// Compares two runs of `filiform bench`: how much each figure changed, and whether the change is more than its spread.
// A figure is identified by workload, table, the values of the row's key columns, and column. Functions without state.
#pragma once

#include "tools/lab/bench/bench.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

// A figure is a regression if it is worse by more than kRegression and its corrected chance is below kSignificant.
inline constexpr double kRegression = 0.10;
inline constexpr double kSignificant = 0.05;

struct Comparison {
  std::string workload, name;  // name: table, row and column
  std::string unit;            // empty for a table's cell, which has its unit in the caption
  double a = 0, b = 0;         // medians over the batches
  double ratio = 0;            // b / a; infinite or NaN where a is 0
  bool tested = false;         // both runs have more than one batch
  double chance = 1;           // two-sided chance of ranks so far apart if nothing changed; 1 where not tested
  double corrected = 1;        // `chance` after Holm's correction for all tested figures
  bool regression = false;
};

struct RunComparison {
  std::vector<Comparison> figures;          // the figures that both runs have, in the order of the first
  std::vector<std::string> only_a, only_b;  // names of figures that one run lacks
  std::vector<std::string> notes;           // what makes the runs hard to compare: machine, size, seed
  std::size_t tested() const;
  std::size_t regressions() const;
};

// The rank-sum test, ties by mean ranks: the chance that a random division of all values into two groups of these
// sizes has rank sums as far apart. Exact up to 60 values, in O((n + m)^2 n); the normal approximation with its
// corrections for ties and continuity beyond. Returns 1 where a group is empty.
double rankSumChance(const std::vector<double>& a, const std::vector<double>& b);

// Holm's correction: the i-th smallest of m chances times m - i, at most 1, never less than a smaller one's. The chance
// that any figure is flagged although none changed stays below the limit. Returns the values in the order given.
std::vector<double> holmCorrected(const std::vector<double>& chances);

// Compares two files bench.json. Throws IoError if a file cannot be read, InputError if it is no bench.json.
RunComparison compareRuns(const std::string& path_a, const std::string& path_b);

// For people: all tested figures, the others where they differ by more than a factor of 2, figures of one run only.
std::string comparisonMarkdown(const RunComparison& comparison);
// All of it as one JSON object.
std::string comparisonJson(const RunComparison& comparison);

}  // namespace filiform::tools
