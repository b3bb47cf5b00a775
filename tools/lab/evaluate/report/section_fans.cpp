#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/report/report_values.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

bool isAlike(const TrialRow& row) { return row.cell % 2 == 1; }  // as in drawFan()
bool isStraight(const TrialRow& row) { return !isAlike(row); }

TrialSummary fansOf(const EvaluationResults& r, const FanFamily& family, double aim_error_m, const std::string& method,
                    const std::function<bool(const TrialRow&)>& keep = {}) {
  return summarise(family.fans, family.trials,
                   findCondition(r.fan_conditions, "fan", aimVariant(aim_error_m), method, kFanZoom_um), Part::all,
                   keep);
}

void addFanGoals(const EvaluationResults& r, Goals& goals) {
  if (!r.has("climb")) return;
  std::string behind;
  std::uint64_t pairs = 0, met = 0;
  for (const FanFamily& family : r.fans)
    for (const double aim_error_m : aimErrors_m()) {
      const std::uint64_t climb = fansOf(r, family, aim_error_m, "climb").completed;
      std::uint64_t most = 0;
      for (const std::string& method : r.protocol.methods)
        if (method != "climb" && method != "nearest")
          most = std::max(most, fansOf(r, family, aim_error_m, method).completed);
      ++pairs;
      met += climb >= most;
      if (climb < most)
        behind += "; " + std::to_string(family.branches) + " branches, " + aimVariant(aim_error_m) + ": " +
                  std::to_string(climb) + " against " + std::to_string(most);
    }
  goals.add("fans: climb completes at least as many as every method of the paper", "at each number of branches and aim",
            ratioText(met, pairs) + " pairs" + behind, met == pairs);
}

void plotFans(const EvaluationResults& r, PageSection& section) {
  Plot plot;
  plot.title = "Fans completed";
  plot.subtitle = "3, 5, 7 and 10 branches together, " + std::to_string(4 * r.fans.front().fans.size()) +
                  " fans at each aim error; medium hand, 200 N/m, 300 um across 12 cm";
  plot.x_label = "error of the aim (mm)";
  plot.y_label = "fans completed (%)";
  for (const std::string& method : r.protocol.methods) {
    PlotSeries series;
    series.name = method;
    series.dots = true;
    series.broad = method == "nearest";
    for (const double aim_error_m : aimErrors_m()) {
      std::uint64_t trials = 0, completed = 0;
      for (const FanFamily& family : r.fans) {
        const TrialSummary s = fansOf(r, family, aim_error_m, method);
        trials += s.trials;
        completed += s.completed;
      }
      series.x.push_back(1e3 * aim_error_m);
      series.y.push_back(100.0 * static_cast<double>(completed) / static_cast<double>(trials));
    }
    plot.series.push_back(std::move(series));
  }
  addPicture(section, plot, r.options.out, "fans.png", "Fans completed against the error of the aim");
}

}  // namespace

BenchTable fanSummaryTable(const EvaluationResults& r) {
  BenchTable table{"fan_completed",
                   "fan: completed of " + std::to_string(r.fans.front().fans.size()) + " fans, one tremor each, seed " +
                       std::to_string(r.options.seed),
                   {"branches", "aim error mm"},
                   {},
                   {"branches", "aim error mm"}};
  for (const std::string& method : r.protocol.methods) table.columns.push_back(method);
  for (const FanFamily& family : r.fans)
    for (const double aim_error_m : aimErrors_m()) {
      std::vector<BenchValue> row{static_cast<std::int64_t>(family.branches), 1e3 * aim_error_m};
      for (const std::string& method : r.protocol.methods)
        row.emplace_back(whole(fansOf(r, family, aim_error_m, method).completed));
      table.rows.push_back(std::move(row));
    }
  return table;
}

PageSection fanSection(const EvaluationResults& r, Goals& goals) {
  PageSection section;
  section.heading = "Fans: many branches nearly parallel";
  section.paragraphs = {
      "The paper's Figure 3: branches leave one node nearly parallel, and the Voronoi region of the middle branch is "
      "narrow. The wanted branch is in the middle; the others stand round it at one angle, drawn from 0.05 to 0.6 rad. "
      "After 30 to 50 um the wanted branch has two sharp elbows. In one half of the fans the other branches are "
      "straight, in the other half they have elbows too (alike). Segments are about 2 to 30 um long, drawn for each "
      "fan.",
      "The error of the aim is constant over a run, and mostly in depth. Medium hand, 200 N/m, 300 um across 12 cm. "
      "Percentiles are over the fans of a row. A run that is not completed counts until the person gave up."};
  BenchTable table{"fan",
                   "Each method on every family, " + std::to_string(r.fans.front().fans.size()) +
                       " fans a row, one tremor each, seed " + std::to_string(r.options.seed),
                   {"branches", "aim error mm", "method", "completed", "straight", "alike", "N s median", "N s p10",
                    "N s p90", "N s mean", "step max N", "off/L", "skip/L"},
                   {},
                   {"branches", "aim error mm", "method"}};
  for (const FanFamily& family : r.fans)
    for (const double aim_error_m : aimErrors_m())
      for (const std::string& method : r.protocol.methods) {
        const TrialSummary s = fansOf(r, family, aim_error_m, method);
        const TrialSummary straight = fansOf(r, family, aim_error_m, method, isStraight);
        const TrialSummary alike = fansOf(r, family, aim_error_m, method, isAlike);
        table.rows.push_back({static_cast<std::int64_t>(family.branches), 1e3 * aim_error_m, method,
                              ratioText(s.completed, s.trials), ratioText(straight.completed, straight.trials),
                              ratioText(alike.completed, alike.trials), s.integral_Ns.median, s.integral_Ns.p10,
                              s.integral_Ns.p90, s.force_integral_Ns / static_cast<double>(s.trials), s.step_max_N,
                              s.off, s.skip});
      }
  section.tables = {fanSummaryTable(r), std::move(table)};
  addFanGoals(r, goals);
  plotFans(r, section);
  return section;
}

}  // namespace filiform::tools
