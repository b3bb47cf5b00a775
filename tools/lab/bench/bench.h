// Named workloads of `filiform bench`: each measures, and answers with tables, goals and notes; the frame writes them
// as JSON and Markdown beside what machine, compiler and libraries they were measured with. Ratios against peers are
// taken in one run. Thread rule: functions without state; a workload runs on the calling thread.
#pragma once

#include "tools/drawing/report.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace filiform::tools {

// What workloads count in.
inline constexpr std::uint64_t kMiB = 1 << 20;
inline constexpr double kPerUm3 = 0.67;           // segments in a um^3 of cortex
inline constexpr double kSegmentsPerCell = 4500;  // of the synthetic column
// Batches whose median is taken. Nine, so that `--compare` can tell a change among a thousand figures: the exact
// rank-sum test of nine against nine reaches 4e-5, of five against five only 8e-3.
inline constexpr int kBatches = 9;

// Ingests of one input, each in a process of its own, whose median is taken: as many as batches up to 1e6 segments,
// five beyond, two in a quick run.
int ingestRuns(std::uint64_t segments, bool quick);

struct BenchOptions {
  std::string out = "filiform-out";  // folder for NAME.json, NAME.md and pictures; exists when a workload runs
  std::uint64_t seed = 1;
  std::string corpus;          // folder of real reconstructions (FILIFORM_CORPUS by default); empty: none
  std::uint64_t segments = 0;  // the largest size to go to; 0: the workload's own
  std::string scene;           // a tile set to travel instead of a synthetic one; empty: none
  bool long_run = false;       // the largest sizes, ten minutes of each loop: hours
  bool quick = false;          // small sizes, no corpus, to see that it works: figures mean nothing
  std::function<void(const std::string& what)> progress;  // never empty when a workload runs
};

using BenchValue = std::variant<std::string, double, std::int64_t>;

// As tables for people show it: numbers with four significant digits.
std::string shown(const BenchValue& value);
// Processor, threads, memory, system, compiler, version of the program.
std::vector<std::pair<std::string, BenchValue>> machineFacts();

// Of the libraries that the product is built with: name, version.
std::vector<std::pair<std::string, std::string>> libraryVersions();

struct BenchTable {
  std::string name;     // a word: the key in the JSON
  std::string caption;  // a line, with units
  std::vector<std::string> columns;
  std::vector<std::vector<BenchValue>> rows;  // each as long as columns
  // The columns that identify a row, for `--compare`; empty: the first column.
  std::vector<std::string> keys = {};
};

// A figure that was promised, beside what came out.
struct BenchGoal {
  std::string what;
  std::string must, aim;  // as promised, for people
  double measured = 0;
  bool met_must = false, met_aim = false;
};

// What an approximate mode promises, beside the largest error that was measured.
struct BenchBound {
  std::string what, stated;  // the mode; the bound in words, with where it is stated
  double bound = 0, measured = 0;
  std::string unit;
  bool holds() const { return measured <= bound; }
};

// A figure measured in batches, so that two runs can be compared with regard to its spread. It is identified by the
// workload, `table`, `row` and `column`, which are those of a table of the report where the table shows its median.
struct BenchSample {
  std::string table;
  std::vector<BenchValue> row;  // values of the table's key columns
  std::string column, unit;
  bool more_is_better = false;
  std::vector<double> batches;
  std::string name() const;  // for people: "TABLE: ROW, ROW: COLUMN"
};

// A trade, drawn: the plot's marks are what is exact, the default, and the knee.
struct BenchCurve {
  std::string name;  // a word
  Plot plot;
  std::string finding;  // a line: what it decided
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

// For people: the caption, and the table as Markdown.
std::string markdownTable(const BenchTable& table);

struct Workload {
  std::string name;     // a word
  std::string summary;  // a line
  std::function<BenchReport(const BenchOptions&)> run;
};

// All there are, in the order of `bench --list`.
std::vector<Workload> workloads();

struct BenchResult {  // of one workload
  std::string name, summary;
  double wall_s = 0;
  BenchReport report;
};

// Runs it, and writes OUT/NAME.json and OUT/NAME.md (bench_record.h). Throws IoError, and what the workload throws.
BenchResult runWorkload(const Workload& workload, const BenchOptions& options);

// A folder of a workload's own below `out`, that goes with it and all that is in it. Throws std::filesystem's errors.
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

// The value below which `fraction` of them lie, by nearest rank; NaN where there are none. O(n).
double percentile(std::vector<double> values, double fraction);
// The medians of kBatches runs of consecutive values, as alike in length as can be: the batches of a sample. Fewer
// where there are fewer values.
std::vector<double> batchMedians(const std::vector<double>& values);
inline double median(const std::vector<double>& values) { return percentile(values, 0.5); }
inline double since_ms(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

// What a piece of work took. Run in a child process of its own, so that its peak memory is its alone: what `work` does
// to this process' memory is lost, the numbers that it returns come back. Throws std::runtime_error if the child fails,
// with its message.
struct ChildCost {
  double wall_s = 0, cpu_s = 0;
  std::uint64_t peak_bytes = 0;  // resident
  std::vector<double> numbers;
};
ChildCost measureInChild(const std::function<std::vector<double>()>& work);

}  // namespace filiform::tools
