#include "solver/travel/run/internal/run_statistics.h"

#include <algorithm>

namespace filiform::internal {

TickRow RunStatistics::add(const NavigationTick& tick, const ProxyPlace& place, const RunTime& time) noexcept {
  TickRow row;
  row.tick = ticks_;
  row.time_s = time.now_s();
  row.h_W = tick.h_W;
  row.p_W = tick.p_W;
  row.segment = place.segment;
  row.force_N = tick.wrench.force_N;
  row.visited = tick.step.visited;
  row.frontier = tick.frontier;

  const double force_N = row.force_N.norm();
  force_sum_N_ += force_N;
  force_periods_N_ += force_N * time.step_periods();
  max_force_N_ = std::max(max_force_N_, force_N);
  max_force_step_N_ = std::max(max_force_step_N_, (row.force_N - last_force_N_).norm());
  last_force_N_ = row.force_N;
  visited_ += tick.step.visited;
  capped_ticks_ += tick.step.capped;
  frontiers_ += tick.frontier;
  for (std::uint32_t i = 0; i < tick.step.touched.count; ++i) touched_[tick.step.touched.ids[i]] = 1;
  ++ticks_;
  return row;
}

void RunStatistics::fill(RunSummary& summary, const RunTime& time) const {
  summary.ticks = ticks_;
  summary.sim_s = time.now_s();
  summary.tiles = static_cast<std::uint64_t>(std::count(touched_.begin(), touched_.end(), 1));
  summary.frontiers = frontiers_;
  summary.mean_force_N = ticks_ > 0 ? force_sum_N_ / static_cast<double>(ticks_) : 0.0;
  summary.max_force_N = max_force_N_;
  summary.force_integral_Ns = force_periods_N_ * time.period_s();
  summary.max_force_step_N = max_force_step_N_;
  summary.visited = visited_;
  summary.capped_ticks = capped_ticks_;
}

}  // namespace filiform::internal
