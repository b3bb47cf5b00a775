#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/report/report_values.h"

#include <cstdint>
#include <string>
#include <utility>

namespace filiform::tools {

PageSection failureSection(const EvaluationResults& r) {
  PageSection section;
  section.heading = "Failures of bounded climb, one by one";
  BenchTable table{"failures",
                   "Routes of the main and stress tables that climb did not complete",
                   {"cell", "from", "to", "hand", "um across 12 cm", "reached um", "of um", "ended", "stuck there",
                    "inherent", "least climb mm", "nearest completes"},
                   {}};
  for (const TrialRow& row : r.trials.rows) {
    const Condition& c = r.conditions[row.condition];
    if (c.setup.method != "climb" || c.table == "ablation" || row.result.completed) continue;
    const CorpusCell& cell = r.corpus.cells[row.cell];
    const DrawnRoute& route = cell.routes[row.route];
    std::string nearest = "-";
    if (r.has("nearest")) {
      const std::uint32_t other = findCondition(r.conditions, c.table, c.variant, "nearest", c.setup.zoom_um);
      for (const TrialRow& one : r.trials.rows)
        if (one.condition == other && one.cell == row.cell && one.route == row.route && one.seed == row.seed)
          nearest = one.result.completed ? "yes" : "no";
    }
    table.rows.push_back({cell.cell.source, whole(static_cast<std::uint64_t>(cell.cell.sample_ids[route.first])),
                          whole(static_cast<std::uint64_t>(cell.cell.sample_ids[route.last])), c.variant,
                          c.setup.zoom_um, row.result.reached_um, row.result.route_um,
                          std::string(row.result.out_of_time ? "out of time" : "gave up"), whole(row.result.last_stuck),
                          whole(row.result.last_inherent), 1e3 * row.result.last_climb_m, nearest});
  }
  section.paragraphs.push_back(
      table.rows.empty()
          ? "None."
          : "Stuck there: how often the person backed off since the last progress, and how many of these were "
            "inherent. Least climb: what would have had to be climbed at the last of the others, in mm of the device.");
  if (!table.rows.empty()) section.tables.push_back(std::move(table));
  return section;
}

}  // namespace filiform::tools
