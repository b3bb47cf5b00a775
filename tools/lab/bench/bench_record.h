// Writes the results of `filiform bench`: JSON (bench.schema.json), CSV, Markdown, and one page with plots. Functions
// without state.
#pragma once

#include "tools/lab/bench/bench.h"

#include <string>
#include <vector>

namespace filiform::tools {

struct BuildFacts {    // of this program
  std::string commit;  // of the sources; "+" is appended if they were changed; "unknown" outside a repository
  std::string flags;   // of the compiler
};
BuildFacts buildFacts();

// Writes the file; replaces an existing one. Throws IoError.
void writeText(const std::string& path, const std::string& text);

// The JSON of one workload: the content of OUT/NAME.json. Throws std::logic_error if a row and the columns differ in
// length.
std::string workloadJson(const BenchResult& result, const BenchOptions& options);
// The same content as Markdown.
std::string workloadMarkdown(const BenchResult& result, const BenchOptions& options);

// The JSON of a run: the content of OUT/bench.json (bench.schema.json).
std::string benchRunJson(const std::vector<BenchResult>& results, const BenchOptions& options, double wall_s,
                         double load_before);

// Writes OUT/bench.json, bench.csv, bench.md and bench.html for all workloads of a run. Throws IoError.
void writeBenchRun(const std::vector<BenchResult>& results, const BenchOptions& options, double wall_s,
                   double load_before);

// Runs the workload and writes OUT/NAME.json and OUT/NAME.md. Throws IoError. Exceptions of the
// workload propagate.
BenchResult runWorkload(const Workload& workload, const BenchOptions& options);

}  // namespace filiform::tools
