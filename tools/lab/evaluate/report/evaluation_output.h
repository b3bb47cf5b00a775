// Writes the files of an evaluation. Functions without state.
#pragma once

#include "tools/lab/evaluate/trials/evaluation_results.h"
#include "tools/lab/shared/page.h"

#include <vector>

namespace filiform::tools {

// Writes trials.csv, timings.csv, hold.csv and cells.csv into r.options.out.
// Throws IoError.
void writeEvaluationData(const EvaluationResults& r);
// Writes evaluate.json, evaluate.md and evaluate.html into the same folder. The plots of the sections must exist.
// `wall_s`: duration of the evaluation. Throws IoError.
void writeEvaluationReport(const EvaluationResults& r, const std::vector<PageSection>& sections, double wall_s);

}  // namespace filiform::tools
