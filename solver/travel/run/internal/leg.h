// One leg of a run: a route, the simulated person who travels it, and the proxy's progress. Legs are created and freed
// outside the haptic thread and used on it. Thread rule: thread-compatible.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/routes/route.h"
#include "solver/travel/routes/simulated_person.h"
#include "solver/travel/run/run_options.h"

#include <cstdint>
#include <optional>

namespace filiform::internal {

struct Leg {
  // `number` counts the legs of a run from 0, so that each leg has its own tremor. Throws UsageError if no tile is the
  // home of the route's first point, and as SimulatedPerson does.
  // `reach`: of the route's cell; none: that of RunOptions::solver.
  Leg(const TileStore& store, const RunOptions& options, Route planned, std::uint64_t number,
      const std::optional<CellReach>& reach);
  Leg(const Leg&) = delete;
  Leg& operator=(const Leg&) = delete;

  const Route::Point& first() const noexcept { return route.points().front(); }
  NodeId firstNode() const noexcept { return {route.cell(), first().rank}; }

  Route route;
  std::optional<CellReach> reach;
  TileId home;  // of the route's first point
  RouteTracker tracker{route};
  SimulatedPerson person;
  double nominal_limit_s;  // 10 times the time at the person's speed, and 20 s
};

}  // namespace filiform::internal
