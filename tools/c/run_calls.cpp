// filiform.h: navigation, whole runs.
#include "solver/travel/run/run.h"
#include "tools/c/open_set.h"

#include <algorithm>
#include <atomic>

namespace filiform::c {

namespace {

RunOptions runOptionsFrom(const filiform_run_options& options, const OpenSet& set) {
  RunOptions wanted;
  if (options.has_cell != 0) {
    set.requireCell(options.cell);
    wanted.cell = options.cell;
  }
  wanted.realtime = options.realtime != 0;
  if (options.route != nullptr) wanted.route = routeChoiceOf(options.route);
  if (options.method != nullptr) wanted.method = solverMethod(options.method);
  if (options.device != nullptr) wanted.device = options.device;
  if (options.record != nullptr) wanted.record = options.record;
  if (options.seconds != 0) wanted.seconds = options.seconds;
  if (options.zoom_um != 0) wanted.zoom_um = options.zoom_um;
  if (options.rate_Hz != 0) wanted.rate_Hz = options.rate_Hz;
  if (options.stiffness_N_m != 0) wanted.stiffness_N_m = options.stiffness_N_m;
  if (options.speed_m_s != 0) wanted.person.speed_m_s = options.speed_m_s;
  wanted.latency_ms = options.latency_ms;
  if (options.budget_bytes != 0) wanted.budget_bytes = options.budget_bytes;
  if (options.seed != 0) wanted.seed = options.seed;
  return wanted;
}

filiform_run_tick tickFrom(const TickRow& row) {
  filiform_run_tick tick{};
  tick.tick = row.tick;
  tick.time_s = row.time_s;
  std::copy_n(row.h_W.data(), 3, tick.probe_um);
  std::copy_n(row.p_W.data(), 3, tick.proxy_um);
  std::copy_n(row.force_N.data(), 3, tick.force_N);
  tick.cell = row.segment.cell;
  tick.segment = row.segment.segment;
  tick.visited = row.visited;
  tick.frontier = row.frontier;
  return tick;
}

filiform_outcome outcomeFrom(RunOutcome outcome) {
  switch (outcome) {
    case RunOutcome::completed:
      return FILIFORM_COMPLETED;
    case RunOutcome::stuck:
      return FILIFORM_STUCK;
    case RunOutcome::time_over:
      return FILIFORM_TIME_OVER;
    case RunOutcome::interrupted:
    case RunOutcome::failed:  // not returned by run()
      return FILIFORM_STOPPED;
  }
  return FILIFORM_STOPPED;
}

}  // namespace

}  // namespace filiform::c

using namespace filiform;
using namespace filiform::c;

extern "C" int filiform_navigate(filiform_set* set, const filiform_run_options* options,
                                 filiform_run_summary* summary) {
  return call([&] {
    const HeldSet held(set, "set");
    sized(summary, "summary");
    const filiform_run_options wanted = optionsOr(options, "options");
    RunOptions running = runOptionsFrom(wanted, **held);
    std::atomic<bool> stop{false};
    running.stop = &stop;
    const RunSummary made = run(*(*held)->set, running, [&](const TickRow& row) {
      if (wanted.on_tick == nullptr) return;
      const filiform_run_tick tick = tickFrom(row);
      if (wanted.on_tick(wanted.user, &tick) != 0) stop = true;
    });
    filiform_run_summary told{};
    told.struct_size = summary->struct_size;
    told.outcome = outcomeFrom(made.outcome);
    told.route_um = made.route_um;
    told.reached_um = made.reached_um;
    told.sim_s = made.sim_s;
    told.mean_force_N = made.mean_force_N;
    told.max_force_N = made.max_force_N;
    told.max_force_step_N = made.max_force_step_N;
    told.stiffness_N_m = made.stiffness_N_m;
    told.ticks = made.ticks;
    told.stalls = made.stalls;
    told.frontiers = made.frontiers;
    told.tiles = made.tiles;
    told.tiles_read = made.tiles_read;
    told.evictions = made.evictions;
    told.peak_bytes = made.peak_bytes;
    told.missed_deadlines = made.missed_deadlines.value_or(0);
    *summary = told;
  });
}
