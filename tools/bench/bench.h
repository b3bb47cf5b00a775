// Named workloads of `filiform bench`: each measures, and answers with tables, goals and notes; the frame writes them
// as JSON and Markdown beside what machine, compiler and libraries they were measured with. Ratios against peers are
// taken in one run. Thread rule: functions without state; a workload runs on the calling thread.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace filiform::tools {

struct BenchOptions {
  std::string out = "filiform-out";  // folder for NAME.json, NAME.md and pictures; exists when a workload runs
  std::uint64_t seed = 1;
  std::string corpus;          // folder of real reconstructions (FILIFORM_CORPUS by default); empty: none
  std::uint64_t segments = 0;  // the largest size to go to; 0: the workload's own
  std::string scene;           // a tile set to travel instead of a synthetic one; empty: none
  bool long_run = false;       // ten minutes of each loop
  bool quick = false;          // small sizes, no corpus, to see that it works: figures mean nothing
  std::function<void(const std::string& what)> progress;  // never empty when a workload runs
};

using BenchValue = std::variant<std::string, double, std::int64_t>;

// As tables for people show it: numbers with four significant digits.
std::string shown(const BenchValue& value);
// Processor, threads, memory, system, compiler, version of the program.
std::vector<std::pair<std::string, BenchValue>> machineFacts();

struct BenchTable {
  std::string name;     // a word: the key in the JSON
  std::string caption;  // a line, with units
  std::vector<std::string> columns;
  std::vector<std::vector<BenchValue>> rows;  // each as long as columns
};

// A figure that was promised, beside what came out.
struct BenchGoal {
  std::string what;
  std::string must, aim;  // as promised, for people
  double measured = 0;
  bool met_must = false, met_aim = false;
};

struct BenchReport {
  std::vector<BenchTable> tables;
  std::vector<BenchGoal> goals;
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

// Runs it, and writes OUT/NAME.json and OUT/NAME.md. Returns the Markdown. Throws IoError, and what the workload
// throws.
std::string runWorkload(const Workload& workload, const BenchOptions& options);

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
