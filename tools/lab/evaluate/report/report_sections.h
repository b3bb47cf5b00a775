// The sections of an evaluation's report. Functions without state. Those with plots write PNG files into r.options.out
// and throw IoError.
#pragma once

#include "tools/lab/evaluate/report/goals.h"
#include "tools/lab/evaluate/trials/evaluation_results.h"
#include "tools/lab/shared/page.h"

#include <vector>

namespace filiform::tools {

PageSection aboutSection(const EvaluationResults& r, const Goals& goals);
PageSection sceneSection(const EvaluationResults& r, Goals& goals);
PageSection fanSection(const EvaluationResults& r, Goals& goals);
PageSection routeSection(const EvaluationResults& r);
PageSection pairedSection(const EvaluationResults& r);  // requires climb
PageSection failureSection(const EvaluationResults& r);
PageSection ablationSection(const EvaluationResults& r);
PageSection holdSection(const EvaluationResults& r);
PageSection parameterSection();

// A row for each scene and method: the medium hand at 200 N/m.
BenchTable sceneForceTable(const EvaluationResults& r);
// A row for each number of branches and aim error: the number of fans that each method completed.
BenchTable fanSummaryTable(const EvaluationResults& r);
// A row for each method and zoom, over the routes of `part`.
BenchTable routeTable(const EvaluationResults& r, const std::string& name, const std::string& table,
                      const std::string& variant, const std::vector<double>& zooms_um, Part part);

}  // namespace filiform::tools
