#include "tools/lab/evaluate/trials/summary.h"

#include "tools/lab/shared/bench_table.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

namespace filiform::tools {

namespace {

bool belongs(const CorpusCell& cell, Part part) {
  return part == Part::all || (part == Part::held_out) == cell.held_out;
}

}  // namespace

Spread spreadOf(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {percentile(values, 0.5), percentile(values, 0.1), percentile(values, 0.9)};
}

std::string shown(const Spread& spread) {
  return shown(BenchValue(spread.median)) + " (" + shown(BenchValue(spread.p10)) + " to " +
         shown(BenchValue(spread.p90)) + ")";
}

TrialSummary summarise(const std::vector<CorpusCell>& cells, const Campaign& campaign, std::uint32_t condition,
                       Part part, const std::function<bool(const TrialRow&)>& keep) {
  TrialSummary s;
  std::vector<double> steps_N, integrals_Ns, per_um_Ns, means_N, solver_ns;
  double seconds = 0, jerks = 0, off_um = 0, skip_um = 0, visited = 0, timed_ns = 0, timed_ticks = 0;
  for (const TrialRow& row : campaign.rows) {
    if (row.condition != condition || !belongs(cells[row.cell], part) || (keep && !keep(row))) continue;
    const TrialResult& r = row.result;
    const auto ticks = static_cast<double>(r.ticks);
    ++s.trials;
    s.completed += r.completed;
    s.route_um += r.route_um;
    s.route_m += r.route_m;
    s.force_integral_Ns += r.force_integral_Ns;
    if (r.mean_force_N > 0) seconds += r.force_integral_Ns / r.mean_force_N;
    integrals_Ns.push_back(r.force_integral_Ns);
    per_um_Ns.push_back(r.force_integral_Ns / r.route_um);
    means_N.push_back(r.mean_force_N);
    steps_N.push_back(r.step_p999_N);
    s.step_max_N = std::max(s.step_max_N, r.step_max_N);
    s.jump_max_m = std::max(s.jump_max_m, r.jump_max_m);
    jerks += static_cast<double>(r.jerks);
    off_um += r.off_um;
    skip_um += r.skip_um;
    visited += static_cast<double>(r.visited);
    s.visited_max = std::max(s.visited_max, r.visited_max);
    s.capped_ticks += r.capped_ticks;
    s.ticks += r.ticks;
    s.stuck += r.stuck;
    s.stuck_inherent += r.stuck_inherent;
    s.inherent_failures += r.inherentFailure();
    s.finite = s.finite && r.finite;
    if (!(r.solver_ns > 0)) continue;
    ++s.timed;
    solver_ns.push_back(r.solver_ns);
    timed_ns += r.solver_ns * ticks;
    timed_ticks += ticks;
  }
  if (s.trials == 0) return s;
  s.force_per_um_Ns = s.force_integral_Ns / s.route_um;
  s.mean_force_N = seconds > 0 ? s.force_integral_Ns / seconds : 0;
  s.step_p999_N = percentile(std::move(steps_N), 0.5);
  s.jerks_per_m = jerks / s.route_m;
  s.off = off_um / s.route_um;
  s.skip = skip_um / s.route_um;
  s.visited_mean = visited / static_cast<double>(s.ticks);
  s.integral_Ns = spreadOf(std::move(integrals_Ns));
  s.integral_per_um_Ns = spreadOf(std::move(per_um_Ns));
  s.trial_mean_force_N = spreadOf(std::move(means_N));
  s.trial_solver_ns = spreadOf(std::move(solver_ns));
  s.solver_ns = timed_ticks > 0 ? timed_ns / timed_ticks : 0;

  VisitCounts counts;
  counts.fill(0);
  std::uint64_t seen = 0;
  for (const int held_out : {0, 1})
    if (part == Part::all || (part == Part::held_out) == (held_out == 1))
      for (std::size_t i = 0; i < counts.size(); ++i)
        counts[i] += campaign.visits[condition][static_cast<std::size_t>(held_out)][i];
  for (std::size_t i = 0; i < counts.size(); ++i) {
    seen += counts[i];
    if (100 * seen >= 99 * s.ticks) {
      s.visited_p99 = i;
      break;
    }
  }
  return s;
}

PairedRatio compare(const std::vector<CorpusCell>& cells, const Campaign& campaign, std::uint32_t first,
                    std::uint32_t second, const std::function<double(const TrialResult&)>& figure, Part part,
                    bool completed_only, const std::function<bool(const TrialRow&)>& keep) {
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, const TrialResult*> seconds;
  for (const TrialRow& row : campaign.rows)
    if (row.condition == second) seconds[{row.cell, row.route, row.seed}] = &row.result;
  PairedRatio paired;
  for (const TrialRow& row : campaign.rows) {
    if (row.condition != first || !belongs(cells[row.cell], part) || (keep && !keep(row))) continue;
    const auto other = seconds.find({row.cell, row.route, row.seed});
    if (other == seconds.end()) continue;
    if (completed_only && !(row.result.completed && other->second->completed)) continue;
    const double by = figure(*other->second);
    if (by > 0) paired.ratios.push_back(figure(row.result) / by);
  }
  std::sort(paired.ratios.begin(), paired.ratios.end());
  paired.pairs = paired.ratios.size();
  paired.median = percentile(paired.ratios, 0.5);
  paired.p10 = percentile(paired.ratios, 0.1);
  paired.p90 = percentile(paired.ratios, 0.9);
  paired.worse = static_cast<std::uint64_t>(paired.ratios.end() -
                                            std::upper_bound(paired.ratios.begin(), paired.ratios.end(), 1.0));
  return paired;
}

std::uint32_t findCondition(const std::vector<Condition>& conditions, const std::string& table,
                            const std::string& variant, const std::string& method, double zoom_um) {
  for (std::uint32_t i = 0; i < conditions.size(); ++i) {
    const Condition& c = conditions[i];
    if (c.table == table && c.variant == variant && c.setup.method == method && c.setup.zoom_um == zoom_um) return i;
  }
  throw std::logic_error("no condition " + table + ", " + variant + ", " + method);
}

}  // namespace filiform::tools
