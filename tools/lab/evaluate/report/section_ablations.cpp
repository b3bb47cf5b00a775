#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/report/report_values.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

PageSection ablationSection(const EvaluationResults& r) {
  PageSection section;
  section.heading = "Ablations: one thing changed at a time";
  section.paragraphs = {"Medium hand, 200 N/m, on a part of the routes, one tremor a route, seed " +
                            std::to_string(r.options.seed) +
                            ": completed of n at each zoom, force integral in N s/um (over all routes, and route by "
                            "route median with p10 "
                            "and p90), largest force step in N.",
                        "Float: positions rounded to 24 bits before tiling, and the probe before each tick (the solver "
                        "itself computes in "
                        "double throughout), at the cell's own place and moved away from the origin."};
  for (const std::string& method : r.protocol.methods) {
    BenchTable table{"ablation_" + method, method, {"condition"}, {}};
    for (const double zoom : ablationZooms()) {
      const std::string at = " at " + formatNumber(zoom);
      table.columns.insert(table.columns.end(), {"completed" + at, "N s/um" + at, "median (p10 to p90)" + at,
                                                 "step max" + at, "capped %" + at});
    }
    for (const std::string& variant : ablationVariants(r.conditions)) {
      std::vector<BenchValue> row{variant};
      for (const double zoom : ablationZooms()) {
        const auto found = std::find_if(r.conditions.begin(), r.conditions.end(), [&](const Condition& c) {
          return c.table == "ablation" && c.variant == variant && c.setup.method == method && c.setup.zoom_um == zoom;
        });
        if (found == r.conditions.end()) break;
        const TrialSummary s = r.routesOf("ablation", variant, method, zoom);
        row.emplace_back(ratioText(s.completed, s.trials));
        row.emplace_back(s.force_per_um_Ns);
        row.emplace_back(shown(s.integral_per_um_Ns));
        row.emplace_back(s.step_max_N);
        row.emplace_back(100.0 * static_cast<double>(s.capped_ticks) / static_cast<double>(s.ticks));
      }
      if (row.size() == table.columns.size()) table.rows.push_back(std::move(row));
    }
    section.tables.push_back(std::move(table));
  }
  return section;
}

}  // namespace filiform::tools
