// The figures of a run, added up tick by tick: forces, segments, frontiers, tiles. Thread rule: thread-compatible;
// add() is haptic-safe.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/run/internal/run_time.h"
#include "solver/travel/run/run_summary.h"
#include "solver/travel/run/tick_row.h"
#include "solver/workspace/navigation.h"

#include <cstdint>
#include <vector>

namespace filiform::internal {

class RunStatistics {
 public:
  // O(tiles).
  explicit RunStatistics(TileId tile_count) : touched_(tile_count, 0) {}

  // After a tick that is not undone, before its time has passed. Returns the tick's row.
  TickRow add(const NavigationTick& tick, const ProxyPlace& place, const RunTime& time) noexcept;

  std::uint64_t ticks() const noexcept { return ticks_; }
  // Writes the figures into the summary. O(tiles).
  void fill(RunSummary& summary, const RunTime& time) const;

 private:
  std::uint64_t ticks_ = 0, visited_ = 0, capped_ticks_ = 0, frontiers_ = 0;
  double force_sum_N_ = 0, force_periods_N_ = 0, max_force_N_ = 0, max_force_step_N_ = 0;
  Vector3d last_force_N_ = Vector3d::Zero();
  std::vector<std::uint8_t> touched_;  // by tile: 1 if the solver has read it
};

}  // namespace filiform::internal
