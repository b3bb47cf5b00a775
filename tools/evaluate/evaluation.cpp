#include "tools/evaluate/evaluation.h"

#include "index/errors.h"
#include "index/output.h"
#include "tools/bench/bench.h"
#include "tools/cli.h"
#include "tools/evaluate/hold.h"
#include "tools/evaluate/page.h"
#include "tools/evaluate/parallel.h"
#include "tools/evaluate/protocol.h"
#include "tools/evaluate/scenes.h"
#include "tools/evaluate/summary.h"
#include "tools/report.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <sstream>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using nlohmann::ordered_json;

std::int64_t whole(std::uint64_t n) { return static_cast<std::int64_t>(n); }

std::string ratioText(std::uint64_t part, std::uint64_t of) {
  return std::to_string(part) + " of " + std::to_string(of);
}

const char* nameOf(Part part) {
  return part == Part::all ? "all cells" : part == Part::open ? "the first two thirds" : "held-out cells";
}

class Evaluation {
 public:
  Evaluation(CellStream& cells, const EvaluationOptions& options) : options_(options) {
    began_ = std::chrono::steady_clock::now();
    for (const std::string& method : options.methods)
      if (std::find(trialMethods().begin(), trialMethods().end(), method) == trialMethods().end())
        throw UsageError("--methods: no method is called " + method + "; choose basic, shading, force, climb, nearest");
    for (const double zoom : options.zooms_um)
      if (!(zoom > 0 && std::isfinite(zoom))) throw UsageError("--zooms: give zooms > 0 in um across 12 cm");
    protocol_.methods = options.methods.empty() ? trialMethods() : options.methods;
    if (!options.zooms_um.empty()) protocol_.zooms_um = options.zooms_um;
    protocol_.quick = options.quick;
    RouteDraw draw;
    draw.seed = options.seed;
    const std::uint64_t routes = options.routes > 0       ? options.routes
                                 : options.quick          ? 4
                                 : options.corpus.empty() ? 24
                                                          : 2000;
    corpus_ = drawCorpus(cells, routes, draw);
    if (corpus_.cells.empty())
      throw InputError("no cell has a route of 40 um or more: is the unit of the files another one than um?");
    protocol_.routes = corpus_.routes;
    scenes_ = evaluationScenes();
  }

  std::string operator()() {
    scene_conditions_ = sceneConditions(protocol_);
    conditions_ = routeConditions(protocol_);
    scene_trials_ = run("scenes", scenes_, scene_conditions_);
    trials_ = run("routes", corpus_.cells, conditions_);
    hold();
    report();
    return write();
  }

 private:
  bool has(const std::string& method) const {
    return std::find(protocol_.methods.begin(), protocol_.methods.end(), method) != protocol_.methods.end();
  }

  CampaignOptions campaignOptions(const std::string& stage) const {
    CampaignOptions options;
    options.seed = options_.seed;
    options.threads = options_.threads;
    options.progress = [this, stage](std::uint64_t done, std::uint64_t total) {
      if (options_.progress) options_.progress(stage, done, total);
    };
    return options;
  }

  Campaign run(const std::string& stage, const std::vector<CorpusCell>& cells,
               const std::vector<Condition>& conditions) const {
    return runCampaign(cells, conditions, campaignOptions(stage));
  }

  // ---- scenes

  const Condition& sceneCondition(const std::string& variant, const std::string& method) const {
    return scene_conditions_[findCondition(scene_conditions_, "scenes", variant, method, kSceneZoom_um)];
  }

  TrialSummary scene(std::uint32_t number, const std::string& variant, const std::string& method) const {
    Campaign one;  // the rows of that scene alone
    for (const TrialRow& row : scene_trials_.rows)
      if (row.cell == number) one.rows.push_back(row);
    one.visits = scene_trials_.visits;
    return summarise(scenes_, one, findCondition(scene_conditions_, "scenes", variant, method, kSceneZoom_um));
  }

  void reportScenes() {
    PageSection section;
    section.heading = "Scenes 1 to 3 (the paper's tables and figures)";
    const std::string base = handVariant("medium", 200);
    const int seeds = sceneCondition(base, protocol_.methods.front()).seeds;
    section.paragraphs = {
        "Scene 1: one path without branches, with concave elbows. Scenes 2 and 3: one branching structure, an easy and "
        "a "
        "hard path through it. " +
            formatNumber(kSceneZoom_um) + " um across 12 cm, medium hand, 200 N/m, " + std::to_string(seeds) +
            " tremors each; figures are means over them. The paper's figures are of a person's hand on another device, "
            "and "
            "of its own scenes (2011, Core i5 at 3.2 GHz): orders may be compared, sizes may not.",
        "Where a run is not completed its integral is that until the person gave up, so it depends on their patience."};
    BenchTable time{"scene_time",
                    "Table 1: time of a tick of the solver and segments tested, beside the paper's",
                    {"scene", "method", "us a tick", "paper us", "segments", "paper segments", "most segments"},
                    {}};
    BenchTable force{"scene_force",
                     "Table 2: force integral and mean force over the path, beside the paper's",
                     {"scene", "method", "completed", "N s", "paper N s", "mean N", "paper mean N", "largest step N",
                      "off/L", "skip/L"},
                     {}};
    for (std::uint32_t number = 0; number < scenes_.size(); ++number) {
      for (const std::string& method : protocol_.methods) {
        const TrialSummary s = scene(number, base, method);
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
    BenchTable all{"scene_hands",
                   "The same under every hand and stiffness: completed, and force integral in N s",
                   {"hand and stiffness", "method"},
                   {}};
    for (std::size_t number = 1; number <= scenes_.size(); ++number) {
      all.columns.push_back("scene " + std::to_string(number));
      all.columns.push_back("N s");
    }
    for (const Condition& c : scene_conditions_) {
      std::vector<BenchValue> row{c.variant, c.setup.method};
      for (std::uint32_t number = 0; number < scenes_.size(); ++number) {
        const TrialSummary s = scene(number, c.variant, c.setup.method);
        row.emplace_back(ratioText(s.completed, s.trials));
        row.emplace_back(s.force_integral_Ns / static_cast<double>(s.trials));
      }
      all.rows.push_back(std::move(row));
    }
    section.tables = {time, force, all};
    if (has("basic") && has("shading") && has("force")) {
      const auto integral = [&](std::uint32_t n, const char* method) {
        return scene(n, base, method).force_integral_Ns;
      };
      for (const std::uint32_t n : {0u, 1u, 2u}) {
        const double f = integral(n, "force"), s = integral(n, "shading"), b = integral(n, "basic");
        goal("scene " + std::to_string(n + 1) + ": force integral force-based < shading < basic", "ordered",
             "force/shading, shading/basic: " + shown(f / s) + ", " + shown(s / b), f < s && s < b);
      }
      const TrialSummary basic = scene(2, base, "basic");
      goal("scene 3: not completed by basic", "0 runs", ratioText(basic.completed, basic.trials), basic.completed == 0);
    }
    plotScenes(section);
    sections_.push_back(std::move(section));
  }

  // Figures 6 and 7: the force at each tick under one tremor, a panel a method on the same axes.
  void plotScenes(PageSection& section) const {
    for (std::size_t number = 0; number < scenes_.size(); ++number) {
      TrialCell cell(scenes_[number].cell);
      const DrawnRoute& drawn = scenes_[number].routes.front();
      const Route route(0, cell.graph().grid, cell.graph().positions, cell.graph().parents, drawn.first, drawn.last);
      std::vector<Plot> panels;
      double longest = 0, strongest = 0;
      for (const std::string& method : protocol_.methods) {
        TrialSetup setup = sceneCondition(handVariant("medium", 200), method).setup;
        setup.seed = options_.seed;
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
      writePng(image, options_.out + "/" + file);
      section.pictures.push_back(
          {file, "Scene " + std::to_string(number + 1) +
                     ": force against tick, as the paper's Figures 6 and 7. Medium hand, 200 N/m, "
                     "300 um across 12 cm, one tremor; a curve ends where the run does."});
    }
  }

  // ---- routes

  TrialSummary routesOf(const std::string& table, const std::string& variant, const std::string& method, double zoom,
                        Part part = Part::all) const {
    return summarise(corpus_.cells, trials_, findCondition(conditions_, table, variant, method, zoom), part);
  }

  BenchTable mainTable(const std::string& name, const std::string& table, const std::string& variant,
                       const std::vector<double>& zooms, Part part) const {
    BenchTable out{name,
                   variant + ", " + nameOf(part),
                   {"method", "um across 12 cm", "completed", "force N s/um", "mean F N", "step p99.9 N", "step max N",
                    "jump max mm", "jerks/m", "off/L", "skip/L", "segments mean", "p99", "max", "failed, inherent",
                    "stuck, inherent"},
                   {}};
    for (const std::string& method : protocol_.methods)
      for (const double zoom : zooms) {
        const TrialSummary s = routesOf(table, variant, method, zoom, part);
        if (s.trials == 0) continue;
        out.rows.push_back({method, zoom, ratioText(s.completed, s.trials), s.force_per_um_Ns, s.mean_force_N,
                            s.step_p999_N, s.step_max_N, 1e3 * s.jump_max_m, s.jerks_per_m, s.off, s.skip,
                            s.visited_mean, whole(s.visited_p99), whole(s.visited_max),
                            std::to_string(s.trials - s.completed) + ", " + std::to_string(s.inherent_failures),
                            std::to_string(s.stuck) + ", " + std::to_string(s.stuck_inherent)});
      }
    return out;
  }

  std::vector<std::string> mainVariants() const {
    std::vector<std::string> variants;
    for (const auto& [hand, stiffness] : mainHands()) {
      variants.push_back(handVariant(hand, stiffness));
      if (options_.quick) break;
    }
    return variants;
  }

  void reportMain() {
    PageSection section;
    section.heading = "Routes: every method under every hand";
    section.paragraphs = {
        "Every run counts, completed or not. Force N s/um: integral of the force over the arc of the routes; step: "
        "change "
        "of the force from one tick to the next (p99.9: median over the runs; max: of all); jump: largest move in a "
        "tick "
        "of the point that the spring pulls to; jerk: a step above 0.25 N, per metre of route on the device; off/L: "
        "arc "
        "travelled off the route; skip/L: arc of the route passed over in leaps of more than 1 mm and two chords; "
        "segments "
        "tested a tick. A failure or a stuck event is inherent where no point of the connected cell is nearer to the "
        "hand "
        "than the proxy (at its strongest pull): no solver that answers with a nearest point could move.",
        "nearest is the oracle: the nearest point of the whole connected cell, at any distance along it. It bounds "
        "force "
        "and completion and is the worst for what it skips."};
    for (const std::string& variant : mainVariants()) {
      const std::string word = variant.substr(0, variant.find(' '));
      section.tables.push_back(mainTable("main_" + word, "main", variant, protocol_.zooms_um, Part::all));
      section.tables.push_back(mainTable("held_out_" + word, "main", variant, protocol_.zooms_um, Part::held_out));
    }
    BenchTable time{
        "time", "Time of a tick of the solver, medium hand (CPU, warm, on a part of the routes)", {"method"}, {}};
    for (const double zoom : protocol_.zooms_um) time.columns.push_back("ns at " + formatNumber(zoom) + " um");
    for (const std::string& method : protocol_.methods) {
      std::vector<BenchValue> row{method};
      for (const double zoom : protocol_.zooms_um)
        row.emplace_back(routesOf("main", mainVariants().front(), method, zoom).solver_ns);
      time.rows.push_back(std::move(row));
    }
    section.tables.push_back(time);
    section.tables.push_back(mainTable("stress", "stress", "medium 200 N/m", {kStressZoom_um}, Part::all));
    section.tables.back().caption = "Stress: 3000 um across 12 cm, medium 200 N/m, a part of the routes";
    plotZooms(section);
    sections_.push_back(std::move(section));
  }

  void plotZooms(PageSection& section) const {
    const std::string variant = mainVariants().front();
    Plot done, force;
    done.title = "Routes completed";
    force.title = "Force integral along the route";
    done.subtitle = force.subtitle = variant + ", all cells; every run counts";
    done.x_label = force.x_label = "world across 12 cm of device (um)";
    done.y_label = "completed (%)";
    force.y_label = "force integral (N s/um)";
    done.x_log = force.x_log = force.y_log = true;
    for (const std::string& method : protocol_.methods) {
      PlotSeries a, b;
      a.name = b.name = method;
      a.markers = b.markers = true;
      a.broad = b.broad = method == "nearest";
      for (const double zoom : protocol_.zooms_um) {
        const TrialSummary s = routesOf("main", variant, method, zoom);
        a.x.push_back(zoom);
        b.x.push_back(zoom);
        a.y.push_back(100.0 * static_cast<double>(s.completed) / static_cast<double>(s.trials));
        b.y.push_back(s.force_per_um_Ns);
      }
      done.series.push_back(std::move(a));
      force.series.push_back(std::move(b));
    }
    if (protocol_.zooms_um.size() > 1) {
      picture(section, done, "completed.png", "Routes completed against zoom");
      picture(section, force, "force.png", "Force integral against zoom");
    }
    for (const double zoom : protocol_.zooms_um) {
      if (zoom != 300) continue;
      Plot steps;
      steps.title = "Largest force step of a run";
      steps.subtitle = variant + ", 300 um across 12 cm: how many runs have none above x";
      steps.x_label = "largest change of the force from one tick to the next (N)";
      steps.y_label = "runs (%)";
      steps.x_log = true;
      for (const std::string& method : protocol_.methods) {
        const std::uint32_t condition = findCondition(conditions_, "main", variant, method, zoom);
        std::vector<double> values;
        for (const TrialRow& row : trials_.rows)
          if (row.condition == condition) values.push_back(row.result.step_max_N);
        steps.series.push_back(cumulative(method, std::move(values)));
        steps.series.back().broad = method == "nearest";
      }
      picture(section, steps, "steps.png", "Largest force step of each run, cumulative");
    }
  }

  static PlotSeries cumulative(const std::string& name, std::vector<double> values) {
    std::sort(values.begin(), values.end());
    PlotSeries series;
    series.name = name;
    for (std::size_t i = 0; i < values.size(); ++i) {
      series.x.push_back(values[i]);
      series.y.push_back(100.0 * static_cast<double>(i + 1) / static_cast<double>(values.size()));
    }
    return series;
  }

  void picture(PageSection& section, const Plot& plot, const std::string& file, const std::string& caption) const {
    writePng(drawPlot(plot), options_.out + "/" + file);
    section.pictures.push_back({file, caption});
  }

  void reportPaired() {
    if (!has("climb")) return;
    PageSection section;
    section.heading = "Bounded climb against the others, route by route";
    section.paragraphs = {
        "Force integral of bounded climb over that of the other method on the same route with the same tremor. Worse: "
        "pairs on which climb has the larger one. First over all pairs, then over those that both completed."};
    BenchTable table{"paired",
                     "Ratio of force integrals, climb over the other",
                     {"cells", "hand", "against", "um across 12 cm", "pairs", "median", "p10", "p90", "worse",
                      "both completed", "median ", "worse "},
                     {}};
    const auto integral = [](const TrialResult& r) { return r.force_integral_Ns; };
    for (const Part part : {Part::all, Part::held_out})
      for (const std::string& variant : mainVariants())
        for (const std::string& method : protocol_.methods) {
          if (method == "climb") continue;
          for (const double zoom : protocol_.zooms_um) {
            const std::uint32_t climb = findCondition(conditions_, "main", variant, "climb", zoom);
            const std::uint32_t other = findCondition(conditions_, "main", variant, method, zoom);
            const PairedRatio every = compare(corpus_.cells, trials_, climb, other, integral, part, false);
            const PairedRatio both = compare(corpus_.cells, trials_, climb, other, integral, part, true);
            table.rows.push_back({std::string(part == Part::all ? "all" : "held out"), variant, method, zoom,
                                  whole(every.pairs), every.median, every.p10, every.p90, whole(every.worse),
                                  whole(both.pairs), both.median, whole(both.worse)});
          }
        }
    section.tables.push_back(std::move(table));
    if (has("force")) {
      Plot plot;
      plot.title = "Force integral: bounded climb over force-based";
      plot.subtitle = mainVariants().front() + ", all cells: how many routes have a ratio of at most x";
      plot.x_label = "ratio of force integrals";
      plot.y_label = "routes (%)";
      plot.x_log = true;
      plot.marks = {{1.0 / 3, "1/3"}, {1.0, "equal"}};
      for (const double zoom : protocol_.zooms_um) {
        const PairedRatio paired = compare(
            corpus_.cells, trials_, findCondition(conditions_, "main", mainVariants().front(), "climb", zoom),
            findCondition(conditions_, "main", mainVariants().front(), "force", zoom), integral, Part::all, false);
        plot.series.push_back(cumulative(formatNumber(zoom) + " um", paired.ratios));
      }
      picture(section, plot, "paired.png", "Force integral of climb over force-based, cumulative over routes");
    }
    sections_.push_back(std::move(section));
  }

  void setGoals() {
    if (!has("climb")) return;
    const auto integral = [](const TrialResult& r) { return r.force_integral_Ns; };
    for (const std::string& variant : mainVariants()) {
      std::uint64_t trials = 0, failed = 0, inherent = 0;
      double step = 0;
      bool finite = true;
      for (const double zoom : protocol_.zooms_um) {
        const TrialSummary s = routesOf("main", variant, "climb", zoom);
        trials += s.trials;
        failed += s.trials - s.completed;
        inherent += s.inherent_failures;
        step = std::max(step, s.step_max_N);
        finite = finite && s.finite;
      }
      goal("climb, " + variant + ": every route completed, or the failure inherent", "0 other failures",
           ratioText(trials - failed, trials) + " completed; of " + std::to_string(failed) + " failures " +
               std::to_string(inherent) + " inherent",
           failed == inherent && finite);
      goal("climb, " + variant + ": largest force step a tick", "<= 0.1 N", shown(step) + " N", step <= 0.1);
      for (const double zoom : protocol_.zooms_um) {
        if (has("nearest")) {
          const TrialSummary climb = routesOf("main", variant, "climb", zoom);
          const TrialSummary nearest = routesOf("main", variant, "nearest", zoom);
          goal("climb, " + variant + ", " + formatNumber(zoom) + " um: off/L and skip/L below nearest's", "below",
               "off " + shown(climb.off) + " against " + shown(nearest.off) + ", skip " + shown(climb.skip) +
                   " against " + shown(nearest.skip),
               climb.off < nearest.off && climb.skip < nearest.skip);
        }
        if (has("force") && zoom >= 300) {
          const PairedRatio paired =
              compare(corpus_.cells, trials_, findCondition(conditions_, "main", variant, "climb", zoom),
                      findCondition(conditions_, "main", variant, "force", zoom), integral, Part::all, false);
          // Over all routes together, as the tables have it; route by route beside it.
          const double ratio = routesOf("main", variant, "climb", zoom).force_integral_Ns /
                               routesOf("main", variant, "force", zoom).force_integral_Ns;
          goal("climb, " + variant + ", " + formatNumber(zoom) + " um: force integral against force-based", "<= 1/3",
               shown(ratio) + " over all routes; route by route median " + shown(paired.median) + ", p10 " +
                   shown(paired.p10) + ", p90 " + shown(paired.p90) + ", worse on " +
                   ratioText(paired.worse, paired.pairs),
               ratio <= 1.0 / 3);
        }
      }
    }
  }

  void reportFailures() {
    PageSection section;
    section.heading = "Failures of bounded climb, one by one";
    BenchTable table{"failures",
                     "Routes of the main and stress tables that climb did not complete",
                     {"cell", "from", "to", "hand", "um across 12 cm", "reached um", "of um", "ended", "stuck there",
                      "inherent", "least climb mm", "nearest completes"},
                     {}};
    for (const TrialRow& row : trials_.rows) {
      const Condition& c = conditions_[row.condition];
      if (c.setup.method != "climb" || c.table == "ablation" || row.result.completed) continue;
      const CorpusCell& cell = corpus_.cells[row.cell];
      const DrawnRoute& route = cell.routes[row.route];
      std::string nearest = "-";
      if (has("nearest")) {
        const std::uint32_t other = findCondition(conditions_, c.table, c.variant, "nearest", c.setup.zoom_um);
        for (const TrialRow& one : trials_.rows)
          if (one.condition == other && one.cell == row.cell && one.route == row.route && one.seed == row.seed)
            nearest = one.result.completed ? "yes" : "no";
      }
      table.rows.push_back(
          {cell.cell.source, whole(static_cast<std::uint64_t>(cell.cell.sample_ids[route.first])),
           whole(static_cast<std::uint64_t>(cell.cell.sample_ids[route.last])), c.variant, c.setup.zoom_um,
           row.result.reached_um, row.result.route_um, std::string(row.result.out_of_time ? "out of time" : "gave up"),
           whole(row.result.last_stuck), whole(row.result.last_inherent), 1e3 * row.result.last_climb_m, nearest});
    }
    section.paragraphs.push_back(
        table.rows.empty()
            ? "None."
            : "Stuck there: how often the person backed off since the last progress, and how many of these were "
              "inherent. "
              "Least climb: what would have had to be climbed at the last of the others, in mm of the device.");
    if (!table.rows.empty()) section.tables.push_back(std::move(table));
    sections_.push_back(std::move(section));
  }

  void reportAblations() {
    PageSection section;
    section.heading = "Ablations: one thing changed at a time";
    section.paragraphs = {
        "Medium hand, 200 N/m, on a part of the routes: completed at each zoom, force integral in N s/um, largest "
        "force "
        "step in N. Float: positions rounded to 24 bits before tiling, and the probe before each tick (the solver "
        "itself "
        "computes in double throughout), at the cell's own place and moved away from the origin."};
    for (const std::string& method : protocol_.methods) {
      BenchTable table{"ablation_" + method, method, {"condition"}, {}};
      for (const double zoom : ablationZooms()) {
        const std::string at = " at " + formatNumber(zoom);
        table.columns.insert(table.columns.end(), {"completed" + at, "N s/um" + at, "step max" + at, "capped %" + at});
      }
      for (const std::string& variant : ablationVariants(conditions_)) {
        std::vector<BenchValue> row{variant};
        for (const double zoom : ablationZooms()) {
          const auto found = std::find_if(conditions_.begin(), conditions_.end(), [&](const Condition& c) {
            return c.table == "ablation" && c.variant == variant && c.setup.method == method && c.setup.zoom_um == zoom;
          });
          if (found == conditions_.end()) break;
          const TrialSummary s = routesOf("ablation", variant, method, zoom);
          row.emplace_back(ratioText(s.completed, s.trials));
          row.emplace_back(s.force_per_um_Ns);
          row.emplace_back(s.step_max_N);
          row.emplace_back(100.0 * static_cast<double>(s.capped_ticks) / static_cast<double>(s.ticks));
        }
        if (row.size() == table.columns.size()) table.rows.push_back(std::move(row));
      }
      section.tables.push_back(std::move(table));
    }
    sections_.push_back(std::move(section));
  }

  // ---- the hold test

  struct Hold {
    std::string method, hand;
    double stiffness_N_m, zoom_um;
    std::vector<HoldResult> results;
  };

  void hold() {
    const std::size_t pulls = options_.quick ? 4 : 300;
    for (const auto& [hand, stiffness] :
         {std::pair<const char*, double>{"medium", 200}, {"medium", 500}, {"loose", 50}})
      for (const double zoom : {300.0, 1000.0})
        for (const std::string& method : protocol_.methods)
          holds_.push_back({method, hand, stiffness, zoom, std::vector<HoldResult>(pulls)});
    constexpr std::size_t kPullsACell = 20;
    const std::size_t groups = (pulls + kPullsACell - 1) / kPullsACell;
    parallelFor(
        groups, options_.threads,
        [&](std::size_t group) {
          const CorpusCell& chosen = corpus_.cells[group * corpus_.cells.size() / groups];
          TrialCell cell(chosen.cell);
          std::mt19937_64 random(options_.seed * 0x9e3779b97f4a7c15u + group);
          const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
          for (std::size_t i = group * kPullsACell; i < std::min(pulls, (group + 1) * kPullsACell); ++i) {
            throwIfInterrupted();
            std::uint32_t child = 0;
            do child = static_cast<std::uint32_t>(random() % cell.graph().samples());
            while (cell.graph().parents[child] == kNoParent);
            const double t = uniform();
            Vector3d pull_m;
            do pull_m = Vector3d(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5);
            while (pull_m.norm() > 0.5 || pull_m.isZero(0));
            pull_m *= 0.03 * uniform() / pull_m.norm();  // up to 30 mm, as far as a person pushes
            for (Hold& hold : holds_) {
              TrialSetup setup;
              setup.method = hold.method;
              setup.hand = hold.hand;
              setup.stiffness_N_m = hold.stiffness_N_m;
              setup.zoom_um = hold.zoom_um;
              hold.results[i] = runHold(cell, child, t, pull_m, setup);
            }
          }
        },
        [&] {
          if (options_.progress) options_.progress("hold test", 0, groups);
        });
  }

  void reportHold() {
    PageSection section;
    section.heading = "Hold test";
    section.paragraphs = {
        "The hand pulls up to 30 mm to a random side of a random place and stays there, without tremor. Oscillates: "
        "hand or "
        "proxy still move by 0.05 mm or more, back and forth, 2 to 2.5 s later; late hop: they move there one way "
        "only. "
        "Energy: the most that the rendered spring gave in any 0.1 s beyond what it had stored."};
    BenchTable table{"hold",
                     "Random pulls",
                     {"method", "hand and stiffness", "um across 12 cm", "pulls", "oscillate", "late hop",
                      "energy max mJ", "energy p99 mJ"},
                     {}};
    for (const Hold& hold : holds_) {
      std::int64_t oscillating = 0, hops = 0;
      std::vector<double> energy_mJ;
      for (const HoldResult& result : hold.results) {
        oscillating += result.oscillates;
        hops += result.late_hop;
        energy_mJ.push_back(1e3 * result.energy_J);
      }
      table.rows.push_back({hold.method, handVariant(hold.hand, hold.stiffness_N_m), hold.zoom_um,
                            whole(hold.results.size()), oscillating, hops, percentile(energy_mJ, 1),
                            percentile(energy_mJ, 0.99)});
    }
    section.tables.push_back(std::move(table));
    sections_.push_back(std::move(section));
  }

  // ---- the whole

  void goal(const std::string& what, const std::string& must, const std::string& measured, bool met) {
    goals_.rows.push_back({what, must, measured, std::string(met ? "met" : "missed")});
  }

  void report() {
    goals_ = {"goals", "What was promised, and what came out", {"what", "must", "measured", "met"}, {}};
    PageSection about;
    about.heading = "What ran";
    std::uint64_t held_out = 0, held_out_routes = 0, cut = 0, tip_to_tip = 0;
    for (const CorpusCell& cell : corpus_.cells) {
      held_out += cell.held_out;
      if (cell.held_out) held_out_routes += cell.routes.size();
      for (const DrawnRoute& route : cell.routes) cut += route.cut, tip_to_tip += route.tip_to_tip;
    }
    std::ostringstream what;
    what << (options_.corpus.empty() ? std::string("Synthetic cells (tools/synthetic.h): ") : options_.corpus + ": ")
         << corpus_.listed << " cells read, " << corpus_.duplicates << " of them with the content of another and "
         << corpus_.unsuitable << " without a route of 40 um (" << corpus_.graphs << " with loops); " << corpus_.routes
         << " routes on " << corpus_.cells.size() << " cells (" << tip_to_tip
         << " from tip to tip, the others from root to tip; of " << cut
         << " longer ones the last 2000 um). Held out: the last third of the cells in the order of their digests, "
         << held_out << " cells with " << held_out_routes << " routes.";
    about.paragraphs.push_back(what.str());
    const std::uint64_t trials = scene_trials_.rows.size() + trials_.rows.size();
    about.paragraphs.push_back(
        std::to_string(trials) + " trials, seed " + std::to_string(options_.seed) + ", " +
        std::to_string(options_.threads) +
        " threads; one tremor a route, ten a scene. Every run counts. A simulated hand: no person "
        "has felt any of this.");
    if (options_.quick) about.paragraphs.push_back("Quick run: these figures mean little.");
    BenchTable ran{"conditions",
                   "Trials by table, variant and method (all zooms together)",
                   {"table", "variant", "method", "trials", "one route in"},
                   {}};
    for (const Condition& c : conditions_) {
      std::int64_t count = 0;
      bool first = true;
      for (const Condition& other : conditions_) {
        const bool same = other.table == c.table && other.variant == c.variant && other.setup.method == c.setup.method;
        if (same && &other < &c) first = false;
        if (same) count += whole(countTrials(corpus_.cells, {other}));
      }
      if (first && c.table != "ablation")
        ran.rows.push_back({c.table, c.variant, c.setup.method, count, static_cast<std::int64_t>(c.one_in)});
    }
    sections_.push_back(std::move(about));
    const std::size_t about_at = sections_.size() - 1;
    reportScenes();
    reportMain();
    reportPaired();
    reportFailures();
    reportAblations();
    reportHold();
    setGoals();
    sections_[about_at].tables = {goals_, ran};

    PageSection parameters;
    parameters.heading = "Parameters and machine";
    parameters.paragraphs = {"Two evaluations can be compared where these are equal."};
    BenchTable table{"parameters", "As they are in this program", {"parameter", "value"}, {}};
    for (const auto& [name, value] : parameterDump()) table.rows.push_back({name, value});
    BenchTable machine{"machine", "Where it ran", {"what", "value"}, {}};
    for (const auto& [name, value] : machineFacts()) machine.rows.push_back({name, shown(value)});
    parameters.tables = {table, machine};
    sections_.push_back(std::move(parameters));
  }

  void writeFile(const std::string& name, const std::string& text) const {
    const std::string path = options_.out + "/" + name;
    Output file(path, {.cancel = &interruptFlag()});
    file.write(text);
    file.finish();
  }

  std::string write() const {
    std::ostringstream trials, timings, holds, cells;
    writeTrialsHeader(trials);
    writeTrials(trials, scenes_, scene_conditions_, scene_trials_);
    writeTrials(trials, corpus_.cells, conditions_, trials_);
    writeTimingsHeader(timings);
    writeTimings(timings, scenes_, scene_conditions_, scene_trials_);
    writeTimings(timings, corpus_.cells, conditions_, trials_);
    holds << "method,hand,stiffness_N_m,zoom_um,pull,oscillates,late_hop,energy_J\n";
    for (const Hold& hold : holds_)
      for (std::size_t i = 0; i < hold.results.size(); ++i)
        holds << hold.method << ',' << hold.hand << ',' << formatNumber(hold.stiffness_N_m) << ','
              << formatNumber(hold.zoom_um) << ',' << i << ',' << hold.results[i].oscillates << ','
              << hold.results[i].late_hop << ',' << formatNumber(hold.results[i].energy_J) << '\n';
    cells << "cell,digest,held_out,samples,routes\n";
    for (const CorpusCell& cell : corpus_.cells) {
      std::string source;
      for (const char c : cell.cell.source) source += c == '"' ? "\"\"" : std::string(1, c);
      std::ostringstream digest;
      digest << std::hex << cell.cell.digest;
      cells << '"' << source << "\"," << digest.str() << ',' << cell.held_out << ',' << cell.cell.samples() << ','
            << cell.routes.size() << '\n';
    }
    writeFile("trials.csv", trials.str());
    writeFile("timings.csv", timings.str());
    writeFile("hold.csv", holds.str());
    writeFile("cells.csv", cells.str());

    const std::string title = "filiform evaluate";
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
    ordered_json json{{"seed", options_.seed},         {"quick", options_.quick},       {"wall_s", wall_s},
                      {"routes", corpus_.routes},      {"cells", corpus_.cells.size()}, {"methods", protocol_.methods},
                      {"zooms_um", protocol_.zooms_um}};
    for (const PageSection& section : sections_) {
      for (const std::string& paragraph : section.paragraphs) json["notes"].push_back(paragraph);
      for (const PagePicture& one : section.pictures) json["pictures"].push_back(one.file);
      for (const BenchTable& table : section.tables) {
        ordered_json rows = ordered_json::array();
        for (const auto& row : table.rows) {
          ordered_json one;
          for (std::size_t i = 0; i < row.size(); ++i)
            one[table.columns[i]] = std::visit([](const auto& v) -> ordered_json { return v; }, row[i]);
          rows.push_back(std::move(one));
        }
        json["tables"][table.name] = {{"caption", table.caption}, {"rows", std::move(rows)}};
      }
    }
    writeFile("evaluate.json", json.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n");
    writeFile("evaluate.md", markdownPage(title, sections_));
    writeFile("evaluate.html", htmlPage(title, sections_, options_.out));

    std::string text = markdownTable(goals_) + '\n';
    text += markdownTable(mainTable("main", "main", mainVariants().front(), protocol_.zooms_um, Part::all));
    text += "\n" + options_.out + "/evaluate.html has everything, after " + shown(wall_s) + " s\n";
    return text;
  }

  EvaluationOptions options_;
  std::chrono::steady_clock::time_point began_;
  ProtocolOptions protocol_;
  TrialCorpus corpus_;
  std::vector<CorpusCell> scenes_;
  std::vector<Condition> scene_conditions_, conditions_;
  Campaign scene_trials_, trials_;
  std::vector<Hold> holds_;
  std::vector<PageSection> sections_;
  BenchTable goals_;
};

}  // namespace

std::string evaluate(CellStream& cells, const EvaluationOptions& options) { return Evaluation(cells, options)(); }

}  // namespace filiform::tools
