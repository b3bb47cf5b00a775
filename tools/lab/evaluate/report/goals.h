// The promises and the measured values: the first table of an evaluation.
// Thread-compatible.
#pragma once

#include "tools/lab/evaluate/trials/evaluation_results.h"
#include "tools/lab/shared/bench_table.h"

#include <string>

namespace filiform::tools {

class Goals {
 public:
  void add(const std::string& what, const std::string& must, const std::string& measured, bool met) {
    table_.rows.push_back({what, must, measured, std::string(met ? "met" : "missed")});
  }
  const BenchTable& table() const { return table_; }

 private:
  BenchTable table_{"goals", "What was promised, and what came out", {"what", "must", "measured", "met"}, {}};
};

// Adds the promises about bounded climb on the routes. Adds nothing if climb did not run.
void addClimbGoals(const EvaluationResults& r, Goals& goals);

}  // namespace filiform::tools
