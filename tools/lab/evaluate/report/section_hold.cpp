#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/report/report_values.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

PageSection holdSection(const EvaluationResults& r) {
  PageSection section;
  section.heading = "Hold test";
  section.paragraphs = {
      "The hand pulls up to 30 mm to a random side of a random place and stays there, without tremor; seed " +
      std::to_string(r.options.seed) +
      ". Oscillates: hand or proxy still move by 0.05 mm or more, back and forth, 2 to 2.5 s later. Late hop: they "
      "move "
      "there one way only. Energy: the most that the rendered spring gave in any 0.1 s beyond what it had stored."};
  BenchTable table{"hold",
                   "Random pulls",
                   {"method", "hand and stiffness", "um across 12 cm", "pulls", "oscillate", "late hop",
                    "energy median mJ", "energy p90 mJ", "energy p99 mJ", "energy max mJ"},
                   {}};
  for (const HoldSeries& hold : r.holds) {
    std::int64_t oscillating = 0, hops = 0;
    std::vector<double> energy_mJ;
    for (const HoldResult& result : hold.results) {
      oscillating += result.oscillates;
      hops += result.late_hop;
      energy_mJ.push_back(1e3 * result.energy_J);
    }
    table.rows.push_back({hold.method, handVariant(hold.hand, hold.stiffness_N_m), hold.zoom_um,
                          whole(hold.results.size()), oscillating, hops, percentile(energy_mJ, 0.5),
                          percentile(energy_mJ, 0.9), percentile(energy_mJ, 0.99), percentile(energy_mJ, 1)});
  }
  section.tables.push_back(std::move(table));
  return section;
}

}  // namespace filiform::tools
