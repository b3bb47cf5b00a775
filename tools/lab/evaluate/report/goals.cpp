#include "tools/lab/evaluate/report/goals.h"

#include "tools/lab/evaluate/report/report_values.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <cstdint>

namespace filiform::tools {

void addClimbGoals(const EvaluationResults& r, Goals& goals) {
  if (!r.has("climb")) return;
  const auto integral = [](const TrialResult& result) { return result.force_integral_Ns; };
  for (const std::string& variant : r.mainVariants()) {
    std::uint64_t trials = 0, failed = 0, inherent = 0;
    double step = 0;
    bool finite = true;
    for (const double zoom : r.protocol.zooms_um) {
      const TrialSummary s = r.routesOf("main", variant, "climb", zoom);
      trials += s.trials;
      failed += s.trials - s.completed;
      inherent += s.inherent_failures;
      step = std::max(step, s.step_max_N);
      finite = finite && s.finite;
    }
    goals.add("climb, " + variant + ": every route completed, or the failure inherent", "0 other failures",
              ratioText(trials - failed, trials) + " completed; of " + std::to_string(failed) + " failures " +
                  std::to_string(inherent) + " inherent",
              failed == inherent && finite);
    goals.add("climb, " + variant + ": largest force step a tick", "<= 0.1 N", shown(step) + " N", step <= 0.1);
    for (const double zoom : r.protocol.zooms_um) {
      if (r.has("nearest")) {
        const TrialSummary climb = r.routesOf("main", variant, "climb", zoom);
        const TrialSummary nearest = r.routesOf("main", variant, "nearest", zoom);
        goals.add("climb, " + variant + ", " + formatNumber(zoom) + " um: off/L and skip/L below nearest's", "below",
                  "off " + shown(climb.off) + " against " + shown(nearest.off) + ", skip " + shown(climb.skip) +
                      " against " + shown(nearest.skip),
                  climb.off < nearest.off && climb.skip < nearest.skip);
      }
      if (r.has("force") && zoom >= 300) {
        const PairedRatio paired =
            compare(r.corpus.cells, r.trials, findCondition(r.conditions, "main", variant, "climb", zoom),
                    findCondition(r.conditions, "main", variant, "force", zoom), integral, Part::all, false);
        // The ratio over all routes together, as in the tables; the ratios route by route beside it.
        const double ratio = r.routesOf("main", variant, "climb", zoom).force_integral_Ns /
                             r.routesOf("main", variant, "force", zoom).force_integral_Ns;
        goals.add("climb, " + variant + ", " + formatNumber(zoom) + " um: force integral against force-based", "<= 1/3",
                  shown(ratio) + " over all routes; route by route median " + shown(paired.median) + ", p10 " +
                      shown(paired.p10) + ", p90 " + shown(paired.p90) + ", worse on " +
                      ratioText(paired.worse, paired.pairs),
                  ratio <= 1.0 / 3);
      }
    }
  }
}

}  // namespace filiform::tools
