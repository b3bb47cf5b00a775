// Compares two runs of `filiform bench`: how much each figure changed, and whether the change exceeds its spread.
// Workload, table, values of the key columns and column identify a figure. Functions without state.
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
  std::string unit;            // empty for a cell of a table, whose caption has the unit
  double a = 0, b = 0;         // medians over the batches
  double ratio = 0;            // b / a; infinite or NaN if a is 0
  bool tested = false;         // both runs have more than one batch
  double chance = 1;           // two-sided chance of ranks so far apart if nothing changed; 1 if not tested
  double corrected = 1;        // `chance` after Holm's correction for all tested figures
  bool regression = false;
};

struct RunComparison {
  std::vector<Comparison> figures;          // the figures of both runs, in the order of the first run
  std::vector<std::string> only_a, only_b;  // names of figures that only one run has
  std::vector<std::string> notes;           // differences of machine, size and seed that make the runs hard to compare
  std::size_t tested() const;
  std::size_t regressions() const;
};

// The rank-sum test; tied values get mean ranks. Returns the chance that a random division of all values into two
// groups of these sizes has rank sums at least as far apart. Exact up to 60 values, in O((n + m)^2 n). Beyond: the
// normal approximation with corrections for ties and continuity. Returns 1 if a group is empty.
double rankSumChance(const std::vector<double>& a, const std::vector<double>& b);

// Holm's correction: the i-th smallest of m chances is multiplied by m - i, at most 1, and never below the result for a
// smaller chance. The chance that any figure is flagged although none changed then stays below the limit. Returns the
// values in the order given.
std::vector<double> holmCorrected(const std::vector<double>& chances);

// Compares two files bench.json. Throws IoError if a file cannot be read, InputError if it is not a bench.json.
RunComparison compareRuns(const std::string& path_a, const std::string& path_b);

// Markdown: all tested figures, untested figures that differ by more than a factor of 2, figures of one run only.
std::string comparisonMarkdown(const RunComparison& comparison);
// Everything as one JSON object.
std::string comparisonJson(const RunComparison& comparison);

}  // namespace filiform::tools
