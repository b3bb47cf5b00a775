// The named workloads of `filiform bench`. Each workload measures and returns tables, goals and notes. bench_record.h
// writes them as JSON and Markdown, with machine, compiler and libraries. Ratios to peers are measured in one run.
// Thread rule: functions without state; a workload runs on the calling thread.
#pragma once

#include "tools/lab/shared/bench_table.h"
#include "tools/pictures/plot.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace filiform::tools {

// Constants that workloads share.
inline constexpr std::uint64_t kMiB = 1 << 20;
inline constexpr double kPerUm3 = 0.67;           // segments in a um^3 of cortex
inline constexpr double kSegmentsPerCell = 4500;  // of the synthetic column
// Number of batches for a median. Nine, so that `compare` can detect a change among a thousand figures: the exact
// rank-sum test of nine against nine reaches 4e-5, of five against five only 8e-3.
inline constexpr int kBatches = 9;

// Number of ingests of one input whose median is taken; each runs in its own process. As many as batches up to 1e6
// segments, five beyond, two in a quick run.
int ingestRuns(std::uint64_t segments, bool quick);

struct BenchOptions {
  std::string out = "filiform-out";  // folder for NAME.json, NAME.md and pictures; must exist when a workload runs
  std::uint64_t seed = 1;
  std::string corpus;          // folder of real reconstructions (FILIFORM_CORPUS by default); empty: none
  std::uint64_t segments = 0;  // largest size; 0: chosen by the workload
  std::string scene;           // tile set to travel; empty: a synthetic one
  bool long_run = false;       // run the largest sizes, and each loop for ten minutes: hours
  bool quick = false;          // run small sizes without corpus, to see that it works; the figures mean nothing
  std::function<void(const std::string& what)> progress;  // must be set when a workload runs
};

// Name and version of the libraries that the program is built with.
std::vector<std::pair<std::string, std::string>> libraryVersions();

// A promise and the measured value.
struct BenchGoal {
  std::string what;
  std::string must, aim;  // the promise and the aim, as text
  double measured = 0;
  bool met_must = false, met_aim = false;
};

// The stated bound of an approximate mode, and the largest error measured.
struct BenchBound {
  std::string what, stated;  // the mode; the bound in words, with the place where it is stated
  double bound = 0, measured = 0;
  std::string unit;
  bool holds() const { return measured <= bound; }
};

// A figure measured in batches, so that two runs can be compared with regard to the spread. Workload, `table`, `row`
// and `column` identify it. If a table of the report shows the median, they are those of the table.
struct BenchSample {
  std::string table;
  std::vector<BenchValue> row;  // values of the table's key columns
  std::string column, unit;
  bool more_is_better = false;
  std::vector<double> batches;
  std::string name() const;  // for readers: "TABLE: ROW, ROW: COLUMN"
};

// The plot of a trade-off. Its vertical lines show the exact point, the default and the knee.
struct BenchCurve {
  std::string name;  // a word
  Plot plot;
  std::string finding;  // a line: what the curve decided
};

struct BenchReport {
  std::vector<BenchTable> tables;
  std::vector<BenchGoal> goals;
  std::vector<BenchBound> bounds;
  std::vector<BenchSample> samples;
  std::vector<BenchCurve> curves;
  std::vector<std::string> notes;
  std::vector<std::pair<std::string, std::string>> versions;  // of peers: name, version
  std::vector<std::string> pictures;                          // file names in `out`
};

struct Workload {
  std::string name;     // a word
  std::string summary;  // a line
  std::function<BenchReport(const BenchOptions&)> run;
};

// All workloads, in the order of `bench --list`.
std::vector<Workload> workloads();

struct BenchResult {  // of one workload
  std::string name, summary;
  double wall_s = 0;
  BenchReport report;
};

// A temporary folder below `out`. The destructor removes it with its content. Throws std::filesystem errors.
class WorkFolder {
 public:
  WorkFolder(const std::string& out, const std::string& name);
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Divides the values, in their order, into kBatches groups of nearly equal size and returns the median of each: the
// batches of a sample. Returns fewer if there are fewer values.
std::vector<double> batchMedians(const std::vector<double>& values);
inline double since_ms(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

// The cost of a piece of work. The work runs in a child process, so that its peak memory is measured alone. Its changes
// to memory are lost; the numbers that it returns come back. Throws std::runtime_error with the child's message if the
// child fails.
struct ChildCost {
  double wall_s = 0, cpu_s = 0;
  std::uint64_t peak_bytes = 0;  // resident
  std::vector<double> numbers;
};
ChildCost measureInChild(const std::function<std::vector<double>()>& work);

}  // namespace filiform::tools
