// What a run of `filiform bench` leaves behind: its JSON (bench.schema.json), CSV, Markdown, and one page with plots.
// Functions without state.
#pragma once

#include "tools/lab/bench/bench.h"

#include <string>
#include <vector>

namespace filiform::tools {

struct BuildFacts {    // of this program
  std::string commit;  // of the sources, with "+" where they were changed; "unknown" outside a repository
  std::string flags;   // of the compiler
};
BuildFacts buildFacts();

// Replaces the file. Throws IoError.
void writeText(const std::string& path, const std::string& text);

// The JSON of one workload, as OUT/NAME.json has it. Throws std::logic_error for a row of another length than the
// columns.
std::string workloadJson(const BenchResult& result, const BenchOptions& options);
// The same for people.
std::string workloadMarkdown(const BenchResult& result, const BenchOptions& options);

// The JSON of a run, as OUT/bench.json has it (bench.schema.json).
std::string benchRunJson(const std::vector<BenchResult>& results, const BenchOptions& options, double wall_s,
                         double load_before);

// Writes OUT/bench.json, bench.csv, bench.md and bench.html, of all workloads of a run. Throws IoError.
void writeBenchRun(const std::vector<BenchResult>& results, const BenchOptions& options, double wall_s,
                   double load_before);

}  // namespace filiform::tools
