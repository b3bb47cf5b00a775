#include "tools/cli.h"
#include "tools/evaluate/report_sections.h"
#include "tools/evaluate/report_values.h"

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
    a.markers = b.markers = true;
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

}  // namespace

BenchTable routeTable(const EvaluationResults& r, const std::string& name, const std::string& table,
                      const std::string& variant, const std::vector<double>& zooms_um, Part part) {
  BenchTable out{name,
                 variant + ", " + nameOf(part),
                 {"method", "um across 12 cm", "completed", "force N s/um", "mean F N", "step p99.9 N", "step max N",
                  "jump max mm", "jerks/m", "off/L", "skip/L", "segments mean", "p99", "max", "failed, inherent",
                  "stuck, inherent"},
                 {}};
  for (const std::string& method : r.protocol.methods)
    for (const double zoom : zooms_um) {
      const TrialSummary s = r.routesOf(table, variant, method, zoom, part);
      if (s.trials == 0) continue;
      out.rows.push_back({method, zoom, ratioText(s.completed, s.trials), s.force_per_um_Ns, s.mean_force_N,
                          s.step_p999_N, s.step_max_N, 1e3 * s.jump_max_m, s.jerks_per_m, s.off, s.skip, s.visited_mean,
                          whole(s.visited_p99), whole(s.visited_max),
                          std::to_string(s.trials - s.completed) + ", " + std::to_string(s.inherent_failures),
                          std::to_string(s.stuck) + ", " + std::to_string(s.stuck_inherent)});
    }
  return out;
}

PageSection routeSection(const EvaluationResults& r) {
  PageSection section;
  section.heading = "Routes: every method under every hand";
  section.paragraphs = {
      "Every run counts, completed or not. Force N s/um: integral of the force "
      "over the arc of the routes; step: "
      "change "
      "of the force from one tick to the next (p99.9: median over the runs; "
      "max: of all); jump: largest move in a "
      "tick "
      "of the point that the spring pulls to; jerk: a step above 0.25 N, per "
      "metre of route on the device; off/L: "
      "arc "
      "travelled off the route; skip/L: arc of the route passed over in leaps "
      "of more than 1 mm and two chords; "
      "segments "
      "tested a tick. A failure or a stuck event is inherent where no point of "
      "the connected cell is nearer to the "
      "hand "
      "than the proxy (at its strongest pull): no solver that answers with a "
      "nearest point could move.",
      "nearest is the oracle: the nearest point of the whole connected cell, "
      "at any distance along it. It bounds "
      "force "
      "and completion and is the worst for what it skips."};
  for (const std::string& variant : r.mainVariants()) {
    const std::string word = variant.substr(0, variant.find(' '));
    section.tables.push_back(routeTable(r, "main_" + word, "main", variant, r.protocol.zooms_um, Part::all));
    section.tables.push_back(routeTable(r, "held_out_" + word, "main", variant, r.protocol.zooms_um, Part::held_out));
  }
  BenchTable time{"time",
                  "Time of a tick of the solver, medium hand (CPU, warm, on a "
                  "part of the routes)",
                  {"method"},
                  {}};
  for (const double zoom : r.protocol.zooms_um) time.columns.push_back("ns at " + formatNumber(zoom) + " um");
  for (const std::string& method : r.protocol.methods) {
    std::vector<BenchValue> row{method};
    for (const double zoom : r.protocol.zooms_um)
      row.emplace_back(r.routesOf("main", r.mainVariants().front(), method, zoom).solver_ns);
    time.rows.push_back(std::move(row));
  }
  section.tables.push_back(time);
  section.tables.push_back(routeTable(r, "stress", "stress", "medium 200 N/m", {kStressZoom_um}, Part::all));
  section.tables.back().caption = "Stress: 3000 um across 12 cm, medium 200 N/m, a part of the routes";
  plotZooms(r, section);
  plotSteps(r, section);
  return section;
}

}  // namespace filiform::tools
