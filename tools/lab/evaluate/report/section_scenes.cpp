#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/report/report_values.h"
#include "tools/lab/evaluate/trials/scenes.h"
#include "tools/lab/evaluate/trials/trial.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

const std::string& baseVariant() {
  static const std::string kBase = handVariant("medium", 200);
  return kBase;
}

std::string seedsText(const EvaluationResults& r, const std::string& variant) {
  return std::to_string(r.sceneCondition(variant, r.protocol.methods.front()).seeds) + " tremors each, seed " +
         std::to_string(r.options.seed);
}

// The paper's figure for a scene (from 0) and method, or the reason why there is none.
BenchValue paperValue(std::uint32_t number, const std::string& method, double PaperFigures::*figure) {
  if (const auto paper = paperFigures(static_cast<int>(number) + 1, method)) return (*paper).*figure;
  return std::string(number == 2 && method == "basic" ? "not completed" : "-");
}

BenchTable paperTimeTable(const EvaluationResults& r) {
  BenchTable table{"scene_time",
                   "Table 1: CPU time of a tick of the solver (caches warm) and segments tested, beside the paper's; " +
                       seedsText(r, baseVariant()) + ", the first of them timed",
                   {"scene", "method", "timed runs", "us a tick", "us p10", "us p90", "paper us", "segments",
                    "paper segments", "most segments"},
                   {},
                   {"scene", "method"}};
  for (std::uint32_t number = 0; number < r.scenes.size(); ++number)
    for (const std::string& method : r.protocol.methods) {
      const TrialSummary s = r.scene(number, baseVariant(), method);
      table.rows.push_back({sceneTitle(r.scenes[number]), method, whole(s.timed), s.solver_ns / 1000,
                            s.trial_solver_ns.p10 / 1000, s.trial_solver_ns.p90 / 1000,
                            paperValue(number, method, &PaperFigures::tick_us), s.visited_mean,
                            paperValue(number, method, &PaperFigures::segments), whole(s.visited_max)});
    }
  return table;
}

BenchTable paperRatioTable(const EvaluationResults& r) {
  BenchTable table{
      "scene_ratios",
      "Ratios of Table 2's force integrals, tremor by tremor, beside the paper's; " + seedsText(r, baseVariant()),
      {"scene", "ratio", "pairs", "median", "p10", "p90", "of the means", "paper"},
      {},
      {"scene", "ratio"}};
  const auto integral = [](const TrialResult& result) { return result.force_integral_Ns; };
  for (std::uint32_t number = 0; number < r.scenes.size(); ++number)
    for (const auto& [first, second] : {std::pair<std::string, std::string>{"basic", "force"},
                                        {"shading", "force"},
                                        {"basic", "shading"},
                                        {"basic", "force-listing"},
                                        {"basic", "climb"}}) {
      if (!r.has(first) || !r.has(second)) continue;
      const PairedRatio paired = compare(r.scenes, r.scene_trials, r.sceneConditionNumber(baseVariant(), first),
                                         r.sceneConditionNumber(baseVariant(), second), integral, Part::all, false,
                                         [number](const TrialRow& row) { return row.cell == number; });
      const auto of = paperFigures(static_cast<int>(number) + 1, first);
      const auto by = paperFigures(static_cast<int>(number) + 1, second);
      table.rows.push_back(
          {sceneTitle(r.scenes[number]), first + " / " + second, whole(paired.pairs), paired.median, paired.p10,
           paired.p90,
           r.scene(number, baseVariant(), first).force_integral_Ns /
               r.scene(number, baseVariant(), second).force_integral_Ns,
           of && by ? BenchValue(of->force_integral_Ns / by->force_integral_Ns) : BenchValue(std::string("-"))});
    }
  return table;
}

BenchTable handsTable(const EvaluationResults& r) {
  BenchTable table{"scene_hands",
                   "The same under every hand, stiffness and error of the aim: completed, and force integral in N s, "
                   "median (p10 to p90); seed " +
                       std::to_string(r.options.seed),
                   {"hand and stiffness", "method", "n"},
                   {},
                   {"hand and stiffness", "method"}};
  for (const CorpusCell& scene : r.scenes) {
    table.columns.push_back(sceneTitle(scene));
    table.columns.push_back(sceneTitle(scene) + " N s");
  }
  for (const Condition& c : r.scene_conditions) {
    std::vector<BenchValue> row{c.variant, c.setup.method, static_cast<std::int64_t>(c.seeds)};
    for (std::uint32_t number = 0; number < r.scenes.size(); ++number) {
      const TrialSummary s = r.scene(number, c.variant, c.setup.method);
      row.emplace_back(whole(s.completed));
      row.emplace_back(shown(s.integral_Ns));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

void addSceneGoals(const EvaluationResults& r, Goals& goals) {
  if (!(r.has("basic") && r.has("shading") && r.has("force"))) return;
  const auto integral = [&](std::uint32_t n, const char* method) {
    return r.scene(n, baseVariant(), method).integral_Ns.median;
  };
  for (const std::uint32_t n : {0u, 1u, 2u}) {
    const double f = integral(n, "force"), s = integral(n, "shading"), b = integral(n, "basic");
    goals.add("scene " + std::to_string(n + 1) + ": median force integral force-based < shading < basic", "ordered",
              "force " + shown(f) + ", shading " + shown(s) + ", basic " + shown(b) + " N s; n " +
                  std::to_string(r.scene(n, baseVariant(), "force").trials),
              f < s && s < b);
  }
  const TrialSummary basic = r.scene(2, baseVariant(), "basic");
  goals.add("scene 3: not completed by basic", "0 runs", ratioText(basic.completed, basic.trials),
            basic.completed == 0);
}

// Figures 6 and 7: the force at each tick with one tremor, a panel for each method on the same axes.
void plotScenes(const EvaluationResults& r, PageSection& section) {
  for (std::size_t number = 0; number < r.scenes.size(); ++number) {
    TrialCell cell(r.scenes[number].cell);
    const DrawnRoute& drawn = r.scenes[number].routes.front();
    const Route route(0, cell.graph().grid, cell.graph().positions, cell.graph().parents, drawn.first, drawn.last);
    std::vector<Plot> panels;
    double longest = 0, strongest = 0;
    for (const std::string& method : r.protocol.methods) {
      TrialSetup setup = r.sceneCondition(baseVariant(), method).setup;
      setup.seed = r.options.seed;
      TrialTrace trace;
      const TrialResult result = runTrial(cell, route, setup, nullptr, &trace);
      Plot plot;
      plot.height = 230;
      plot.title = sceneTitle(r.scenes[number]) + ", " + method + ": " +
                   (result.completed ? "completed" : "not completed") + ", " + shown(result.force_integral_Ns) +
                   " N s, mean " + shown(result.mean_force_N) + " N";
      plot.y_label = "force (N)";
      PlotSeries series;
      for (std::size_t i = 0; i < trace.force_N.size(); ++i) {
        series.x.push_back(static_cast<double>(i));
        series.y.push_back(static_cast<double>(trace.force_N[i]));
      }
      longest = std::max(longest, static_cast<double>(trace.force_N.size()));
      strongest = std::max(strongest, result.max_force_N);
      plot.series.push_back(std::move(series));
      panels.push_back(std::move(plot));
    }
    panels.back().x_label = "tick (ms)";
    panels.back().height += 24;
    Picture picture;
    for (Plot& plot : panels) {
      plot.x_most = longest;
      plot.y_most = strongest;
      const Picture panel = drawPlot(plot);
      picture.width = panel.width;
      picture.height += panel.height;
      picture.rgb.insert(picture.rgb.end(), panel.rgb.begin(), panel.rgb.end());
    }
    const std::string file = r.scenes[number].cell.source + ".png";
    writePng(picture, r.options.out + "/" + file);
    section.pictures.push_back(
        {file,
         sceneTitle(r.scenes[number]) +
             ": force against tick, as the paper's Figures 6 and 7. Medium hand, 200 N/m, 300 um across 12 cm, one "
             "tremor (seed " +
             std::to_string(r.options.seed) + "). A curve ends where the run does."});
  }
}

}  // namespace

BenchTable sceneForceTable(const EvaluationResults& r) {
  BenchTable table{
      "scene_force",
      "Table 2: force integral and mean force over the path, beside the paper's; " + seedsText(r, baseVariant()),
      {"scene", "method", "completed", "N s median", "N s p10", "N s p90", "N s mean", "paper N s", "F median N",
       "F p10 N", "F p90 N", "F mean N", "paper F N", "largest step N", "off/L", "skip/L"},
      {},
      {"scene", "method"}};
  for (std::uint32_t number = 0; number < r.scenes.size(); ++number)
    for (const std::string& method : r.protocol.methods) {
      const TrialSummary s = r.scene(number, baseVariant(), method);
      table.rows.push_back({sceneTitle(r.scenes[number]), method, ratioText(s.completed, s.trials),
                            s.integral_Ns.median, s.integral_Ns.p10, s.integral_Ns.p90,
                            s.force_integral_Ns / static_cast<double>(s.trials),
                            paperValue(number, method, &PaperFigures::force_integral_Ns), s.trial_mean_force_N.median,
                            s.trial_mean_force_N.p10, s.trial_mean_force_N.p90, s.mean_force_N,
                            paperValue(number, method, &PaperFigures::mean_force_N), s.step_max_N, s.off, s.skip});
    }
  return table;
}

PageSection sceneSection(const EvaluationResults& r, Goals& goals) {
  PageSection section;
  section.heading = "Scenes (the paper's tables and figures)";
  section.paragraphs = {
      "Scene 1: one path without branches, with sharp concave elbows. Scenes 2 and 3: two ways through one branching "
      "structure, one with simple forks, one with nodes from which several branches leave nearly parallel. Elbows: "
      "scene 1 with rounded corners. Hooks: wide forks, rounded corners and two hooks. " +
          formatNumber(kSceneZoom_um) +
          " um across 12 cm, medium hand, 200 N/m. The paper's figures come from a person's hand on another device, in "
          "scenes of its own (2011, Core i5 at 3.2 GHz). Orders and ratios may be compared, sizes may not.",
      "Method force is the paper's section 3.3 as its text says, force-listing as its listings say. The paper does not "
      "state which of both its tables have; its figures stand beside force.",
      "Where a run is not completed, its integral is that until the person gave up. It then depends on their "
      "patience."};
  section.tables = {paperTimeTable(r), sceneForceTable(r), paperRatioTable(r), handsTable(r)};
  addSceneGoals(r, goals);
  plotScenes(r, section);
  return section;
}

}  // namespace filiform::tools
