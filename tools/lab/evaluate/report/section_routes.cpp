#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/report/report_values.h"
#include "tools/words/numbers.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

const char* nameOf(Part part) {
  return part == Part::all ? "all cells" : part == Part::open ? "the first two thirds" : "held-out cells";
}

void plotZooms(const EvaluationResults& r, PageSection& section) {
  const std::string variant = r.mainVariants().front();
  Plot done, force;
  done.title = "Routes completed";
  force.title = "Force integral along the route";
  done.subtitle = force.subtitle = variant + ", all cells; every run counts";
  done.x_label = force.x_label = "world across 12 cm of device (um)";
  done.y_label = "completed (%)";
  force.y_label = "force integral (N s/um)";
  done.x_log = force.x_log = force.y_log = true;
  for (const std::string& method : r.protocol.methods) {
    PlotSeries a, b;
    a.name = b.name = method;
    a.dots = b.dots = true;
    a.broad = b.broad = method == "nearest";
    for (const double zoom : r.protocol.zooms_um) {
      const TrialSummary s = r.routesOf("main", variant, method, zoom);
      a.x.push_back(zoom);
      b.x.push_back(zoom);
      a.y.push_back(100.0 * static_cast<double>(s.completed) / static_cast<double>(s.trials));
      b.y.push_back(s.force_per_um_Ns);
    }
    done.series.push_back(std::move(a));
    force.series.push_back(std::move(b));
  }
  if (r.protocol.zooms_um.size() > 1) {
    addPicture(section, done, r.options.out, "completed.png", "Routes completed against zoom");
    addPicture(section, force, r.options.out, "force.png", "Force integral against zoom");
  }
}

void plotSteps(const EvaluationResults& r, PageSection& section) {
  const std::string variant = r.mainVariants().front();
  for (const double zoom : r.protocol.zooms_um) {
    if (zoom != 300) continue;
    Plot steps;
    steps.title = "Largest force step of a run";
    steps.subtitle = variant + ", 300 um across 12 cm: how many runs have none above x";
    steps.x_label = "largest change of the force from one tick to the next (N)";
    steps.y_label = "runs (%)";
    steps.x_log = true;
    for (const std::string& method : r.protocol.methods) {
      const std::uint32_t condition = findCondition(r.conditions, "main", variant, method, zoom);
      std::vector<double> values;
      for (const TrialRow& row : r.trials.rows)
        if (row.condition == condition) values.push_back(row.result.step_max_N);
      steps.series.push_back(cumulative(method, std::move(values)));
      steps.series.back().broad = method == "nearest";
    }
    addPicture(section, steps, r.options.out, "steps.png", "Largest force step of each run, cumulative");
  }
}

BenchTable timeTable(const EvaluationResults& r) {
  BenchTable time{
      "time",
      "CPU time of a tick of the solver, ns: mean (median over routes, p10 to p90), caches warm, medium hand, "
      "on a part of the routes",
      {"method", "runs a zoom"},
      {}};
  for (const double zoom : r.protocol.zooms_um) time.columns.push_back("ns at " + formatNumber(zoom) + " um");
  for (const std::string& method : r.protocol.methods) {
    std::vector<BenchValue> row{method, std::int64_t{0}};
    for (const double zoom : r.protocol.zooms_um) {
      const TrialSummary s = r.routesOf("main", r.mainVariants().front(), method, zoom);
      row[1] = whole(s.timed);
      row.emplace_back(shown(BenchValue(s.solver_ns)) + " (" + shown(s.trial_solver_ns) + ")");
    }
    time.rows.push_back(std::move(row));
  }
  return time;
}

}  // namespace

BenchTable routeTable(const EvaluationResults& r, const std::string& name, const std::string& table,
                      const std::string& variant, const std::vector<double>& zooms_um, Part part) {
  BenchTable out{name,
                 variant + ", " + nameOf(part) + "; one tremor a route, seed " + std::to_string(r.options.seed),
                 {"method", "um across 12 cm", "completed", "force N s/um", "median", "p10", "p90", "mean F N",
                  "step p99.9 N", "step max N", "jump max mm", "jerks/m", "off/L", "skip/L", "segments mean", "p99",
                  "max", "failed, inherent", "stuck, inherent"},
                 {},
                 {"method", "um across 12 cm"}};
  for (const std::string& method : r.protocol.methods)
    for (const double zoom : zooms_um) {
      const TrialSummary s = r.routesOf(table, variant, method, zoom, part);
      if (s.trials == 0) continue;
      out.rows.push_back({method, zoom, ratioText(s.completed, s.trials), s.force_per_um_Ns,
                          s.integral_per_um_Ns.median, s.integral_per_um_Ns.p10, s.integral_per_um_Ns.p90,
                          s.mean_force_N, s.step_p999_N, s.step_max_N, 1e3 * s.jump_max_m, s.jerks_per_m, s.off, s.skip,
                          s.visited_mean, whole(s.visited_p99), whole(s.visited_max),
                          std::to_string(s.trials - s.completed) + ", " + std::to_string(s.inherent_failures),
                          std::to_string(s.stuck) + ", " + std::to_string(s.stuck_inherent)});
    }
  return out;
}

PageSection routeSection(const EvaluationResults& r) {
  PageSection section;
  section.heading = "Routes: every method under every hand";
  section.paragraphs = {
      "Every run counts, completed or not. Force N s/um: the sum of the force integrals over the sum of the routes' "
      "arcs; "
      "median, p10 and p90: of the same ratio route by route. Step: change of the force from one tick to the next "
      "(p99.9: median over the runs; max: of all). Jump: largest move in a tick of the point that the spring pulls to. "
      "Jerk: a step above 0.25 N, per metre of route on the device. Off/L: arc travelled off the route. Skip/L: arc of "
      "the route passed over in leaps of more than 1 mm and two chords. Segments: tested in a tick.",
      "A failure or a stuck event is inherent where no point of the connected cell is nearer to the hand than the "
      "proxy "
      "(at the hand's strongest pull): no solver that answers with a nearest point could move.",
      "Method nearest is the oracle: the nearest point of the whole connected cell, at any distance along it. It "
      "bounds "
      "force and completion, and skips most. Method force is the paper's section 3.3 as its text says, force-listing "
      "as "
      "its listings say."};
  for (const std::string& variant : r.mainVariants()) {
    const std::string word = variant.substr(0, variant.find(' '));
    section.tables.push_back(routeTable(r, "main_" + word, "main", variant, r.protocol.zooms_um, Part::all));
    section.tables.push_back(routeTable(r, "held_out_" + word, "main", variant, r.protocol.zooms_um, Part::held_out));
  }
  section.tables.push_back(timeTable(r));
  section.tables.push_back(routeTable(r, "stress", "stress", "medium 200 N/m", {kStressZoom_um}, Part::all));
  section.tables.back().caption =
      "Stress: 3000 um across 12 cm, medium hand, 200 N/m, a part of the routes; one tremor a "
      "route, seed " +
      std::to_string(r.options.seed);
  plotZooms(r, section);
  plotSteps(r, section);
  return section;
}

}  // namespace filiform::tools
