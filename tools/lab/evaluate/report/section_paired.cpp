#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/report/report_values.h"
#include "tools/words/numbers.h"

#include <cstdint>
#include <string>
#include <utility>

namespace filiform::tools {

PageSection pairedSection(const EvaluationResults& r) {
  PageSection section;
  section.heading = "Bounded climb against the others, route by route";
  section.paragraphs = {
      "Force integral of bounded climb over that of the other method on the same route with the same tremor. Worse: "
      "pairs on which climb has the larger one. First over all pairs, then over those that both completed."};
  BenchTable table{
      "paired",
      "Ratio of force integrals, climb over the other; one tremor a route, seed " + std::to_string(r.options.seed),
      {"cells", "hand", "against", "um across 12 cm", "pairs", "median", "p10", "p90", "worse", "both completed",
       "median ", "worse "},
      {}};
  const auto integral = [](const TrialResult& result) { return result.force_integral_Ns; };
  for (const Part part : {Part::all, Part::held_out})
    for (const std::string& variant : r.mainVariants())
      for (const std::string& method : r.protocol.methods) {
        if (method == "climb") continue;
        for (const double zoom : r.protocol.zooms_um) {
          const std::uint32_t climb = findCondition(r.conditions, "main", variant, "climb", zoom);
          const std::uint32_t other = findCondition(r.conditions, "main", variant, method, zoom);
          const PairedRatio every = compare(r.corpus.cells, r.trials, climb, other, integral, part, false);
          const PairedRatio both = compare(r.corpus.cells, r.trials, climb, other, integral, part, true);
          table.rows.push_back({std::string(part == Part::all ? "all" : "held out"), variant, method, zoom,
                                whole(every.pairs), every.median, every.p10, every.p90, whole(every.worse),
                                whole(both.pairs), both.median, whole(both.worse)});
        }
      }
  section.tables.push_back(std::move(table));
  if (r.has("force")) {
    Plot plot;
    plot.title = "Force integral: bounded climb over force-based";
    plot.subtitle = r.mainVariants().front() + ", all cells: how many routes have a ratio of at most x";
    plot.x_label = "ratio of force integrals";
    plot.y_label = "routes (%)";
    plot.x_log = true;
    plot.lines = {{1.0 / 3, "1/3"}, {1.0, "equal"}};
    for (const double zoom : r.protocol.zooms_um) {
      const PairedRatio paired = compare(
          r.corpus.cells, r.trials, findCondition(r.conditions, "main", r.mainVariants().front(), "climb", zoom),
          findCondition(r.conditions, "main", r.mainVariants().front(), "force", zoom), integral, Part::all, false);
      plot.series.push_back(cumulative(formatNumber(zoom) + " um", paired.ratios));
    }
    addPicture(section, plot, r.options.out, "paired.png",
               "Force integral of climb over force-based, cumulative over routes");
  }
  return section;
}

}  // namespace filiform::tools
