#include "tools/cli.h"
#include "tools/evaluate/report_sections.h"
#include "tools/evaluate/report_values.h"
#include "tools/evaluate/scenes.h"
#include "tools/evaluate/trial.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

// Tables 1 and 2 of the paper.
std::vector<BenchTable> paperTables(const EvaluationResults& r) {
  const std::string base = handVariant("medium", 200);
  BenchTable time{"scene_time",
                  "Table 1: time of a tick of the solver and segments tested, "
                  "beside the paper's",
                  {"scene", "method", "us a tick", "paper us", "segments", "paper segments", "most segments"},
                  {}};
  BenchTable force{"scene_force",
                   "Table 2: force integral and mean force over the path, "
                   "beside the paper's",
                   {"scene", "method", "completed", "N s", "paper N s", "mean N", "paper mean N", "largest step N",
                    "off/L", "skip/L"},
                   {}};
  for (std::uint32_t number = 0; number < r.scenes.size(); ++number) {
    for (const std::string& method : r.protocol.methods) {
      const TrialSummary s = r.scene(number, base, method);
      const auto paper = paperFigures(static_cast<int>(number) + 1, method);
      const auto beside = [&](double PaperFigures::*figure) -> BenchValue {
        if (paper) return (*paper).*figure;
        return std::string(method == "basic" ? "not completed" : "-");
      };
      const std::string name = "scene " + std::to_string(number + 1);
      time.rows.push_back({name, method, s.solver_ns / 1000, beside(&PaperFigures::tick_us), s.visited_mean,
                           beside(&PaperFigures::segments), whole(s.visited_max)});
      force.rows.push_back({name, method, ratioText(s.completed, s.trials),
                            s.force_integral_Ns / static_cast<double>(s.trials),
                            beside(&PaperFigures::force_integral_Ns), s.mean_force_N,
                            beside(&PaperFigures::mean_force_N), s.step_max_N, s.off, s.skip});
    }
  }
  return {std::move(time), std::move(force)};
}

BenchTable handsTable(const EvaluationResults& r) {
  BenchTable all{"scene_hands",
                 "The same under every hand and stiffness: completed, and "
                 "force integral in N s",
                 {"hand and stiffness", "method"},
                 {}};
  for (std::size_t number = 1; number <= r.scenes.size(); ++number) {
    all.columns.push_back("scene " + std::to_string(number));
    all.columns.push_back("N s");
  }
  for (const Condition& c : r.scene_conditions) {
    std::vector<BenchValue> row{c.variant, c.setup.method};
    for (std::uint32_t number = 0; number < r.scenes.size(); ++number) {
      const TrialSummary s = r.scene(number, c.variant, c.setup.method);
      row.emplace_back(ratioText(s.completed, s.trials));
      row.emplace_back(s.force_integral_Ns / static_cast<double>(s.trials));
    }
    all.rows.push_back(std::move(row));
  }
  return all;
}

void addSceneGoals(const EvaluationResults& r, Goals& goals) {
  const std::string base = handVariant("medium", 200);
  if (!(r.has("basic") && r.has("shading") && r.has("force"))) return;
  const auto integral = [&](std::uint32_t n, const char* method) { return r.scene(n, base, method).force_integral_Ns; };
  for (const std::uint32_t n : {0u, 1u, 2u}) {
    const double f = integral(n, "force"), s = integral(n, "shading"), b = integral(n, "basic");
    goals.add("scene " + std::to_string(n + 1) + ": force integral force-based < shading < basic", "ordered",
              "force/shading, shading/basic: " + shown(f / s) + ", " + shown(s / b), f < s && s < b);
  }
  const TrialSummary basic = r.scene(2, base, "basic");
  goals.add("scene 3: not completed by basic", "0 runs", ratioText(basic.completed, basic.trials),
            basic.completed == 0);
}

// Figures 6 and 7: the force at each tick under one tremor, a panel a method on
// the same axes.
void plotScenes(const EvaluationResults& r, PageSection& section) {
  for (std::size_t number = 0; number < r.scenes.size(); ++number) {
    TrialCell cell(r.scenes[number].cell);
    const DrawnRoute& drawn = r.scenes[number].routes.front();
    const Route route(0, cell.graph().grid, cell.graph().positions, cell.graph().parents, drawn.first, drawn.last);
    std::vector<Plot> panels;
    double longest = 0, strongest = 0;
    for (const std::string& method : r.protocol.methods) {
      TrialSetup setup = r.sceneCondition(handVariant("medium", 200), method).setup;
      setup.seed = r.options.seed;
      TrialTrace trace;
      const TrialResult result = runTrial(cell, route, setup, nullptr, &trace);
      Plot plot;
      plot.height = 230;
      plot.title = "Scene " + std::to_string(number + 1) + ", " + method + ": " +
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
    Image image;
    for (Plot& plot : panels) {
      plot.x_most = longest;
      plot.y_most = strongest;
      const Image panel = drawPlot(plot);
      image.width = panel.width;
      image.height += panel.height;
      image.rgb.insert(image.rgb.end(), panel.rgb.begin(), panel.rgb.end());
    }
    const std::string file = "scene" + std::to_string(number + 1) + ".png";
    writePng(image, r.options.out + "/" + file);
    section.pictures.push_back({file, "Scene " + std::to_string(number + 1) +
                                          ": force against tick, as the paper's Figures 6 and 7. "
                                          "Medium hand, 200 N/m, "
                                          "300 um across 12 cm, one tremor; a curve ends where the "
                                          "run does."});
  }
}

}  // namespace

PageSection sceneSection(const EvaluationResults& r, Goals& goals) {
  PageSection section;
  section.heading = "Scenes 1 to 3 (the paper's tables and figures)";
  const std::string base = handVariant("medium", 200);
  const int seeds = r.sceneCondition(base, r.protocol.methods.front()).seeds;
  section.paragraphs = {
      "Scene 1: one path without branches, with concave elbows. Scenes 2 and "
      "3: one branching structure, an easy and "
      "a "
      "hard path through it. " +
          formatNumber(kSceneZoom_um) + " um across 12 cm, medium hand, 200 N/m, " + std::to_string(seeds) +
          " tremors each; figures are means over them. The paper's figures are "
          "of a person's hand on another device, "
          "and "
          "of its own scenes (2011, Core i5 at 3.2 GHz): orders may be "
          "compared, sizes may not.",
      "Where a run is not completed its integral is that until the person gave "
      "up, so it depends on their patience."};
  section.tables = paperTables(r);
  section.tables.push_back(handsTable(r));
  addSceneGoals(r, goals);
  plotScenes(r, section);
  return section;
}

}  // namespace filiform::tools
