#include "tools/lab/evaluate/report/report_sections.h"
#include "tools/lab/evaluate/report/report_values.h"

#include <cstdint>
#include <sstream>
#include <string>
#include <utility>

namespace filiform::tools {

namespace {

BenchTable conditionTable(const EvaluationResults& r) {
  BenchTable ran{"conditions",
                 "Trials by table, variant and method (all zooms together)",
                 {"table", "variant", "method", "trials", "one route in"},
                 {}};
  for (const Condition& c : r.conditions) {
    std::int64_t count = 0;
    bool first = true;
    for (const Condition& other : r.conditions) {
      const bool same = other.table == c.table && other.variant == c.variant && other.setup.method == c.setup.method;
      if (same && &other < &c) first = false;
      if (same) count += whole(countTrials(r.corpus.cells, {other}));
    }
    if (first && c.table != "ablation")
      ran.rows.push_back({c.table, c.variant, c.setup.method, count, static_cast<std::int64_t>(c.one_in)});
  }
  return ran;
}

}  // namespace

PageSection aboutSection(const EvaluationResults& r, const Goals& goals) {
  PageSection about;
  about.heading = "What ran";
  std::uint64_t held_out = 0, held_out_routes = 0, cut = 0, tip_to_tip = 0;
  for (const CorpusCell& cell : r.corpus.cells) {
    held_out += cell.held_out;
    if (cell.held_out) held_out_routes += cell.routes.size();
    for (const DrawnRoute& route : cell.routes) cut += route.cut, tip_to_tip += route.tip_to_tip;
  }
  std::ostringstream what;
  what << (r.options.corpus.empty() ? std::string("Synthetic cells (tools/synthetic/synthetic.h): ")
                                    : r.options.corpus + ": ")
       << r.corpus.listed << " cells read, " << r.corpus.duplicates << " of them with the content of another and "
       << r.corpus.unsuitable << " without a route of 40 um (" << r.corpus.graphs << " with loops); " << r.corpus.routes
       << " routes on " << r.corpus.cells.size() << " cells (" << tip_to_tip
       << " from tip to tip, the others from root to tip; of " << cut
       << " longer ones the last 2000 um). Held out: the last third of the cells in the order of their digests, "
       << held_out << " cells with " << held_out_routes << " routes.";
  about.paragraphs.push_back(what.str());
  std::uint64_t trials = r.scene_trials.rows.size() + r.trials.rows.size();
  for (const FanFamily& family : r.fans) trials += family.trials.rows.size();
  about.paragraphs.push_back(std::to_string(trials) + " trials, seed " + std::to_string(r.options.seed) + ", " +
                             std::to_string(r.options.threads) +
                             " threads; one tremor a route and a fan, 200 or 50 a scene. Every run counts. Percentiles "
                             "(p10, p90) are over the runs of a row. The hand is simulated: no person has felt any of "
                             "this.");
  if (r.options.quick) about.paragraphs.push_back("Quick run: these figures mean little.");
  about.tables = {goals.table(), conditionTable(r)};
  return about;
}

PageSection parameterSection() {
  PageSection parameters;
  parameters.heading = "Parameters and machine";
  parameters.paragraphs = {"Two evaluations can be compared where these are equal."};
  BenchTable table{"parameters", "As they are in this program", {"parameter", "value"}, {}};
  for (const auto& [name, value] : parameterDump()) table.rows.push_back({name, value});
  BenchTable machine{"machine", "Where it ran", {"what", "value"}, {}};
  for (const auto& [name, value] : machineFacts()) machine.rows.push_back({name, shown(value)});
  parameters.tables = {table, machine};
  return parameters;
}

}  // namespace filiform::tools
