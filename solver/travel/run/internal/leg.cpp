#include "solver/travel/run/internal/leg.h"

#include "index/errors.h"
#include "solver/workspace/workspace.h"

#include <utility>

namespace filiform::internal {

namespace {

TileId homeOf(const TileStore& store, const Route& route) {
  const TileId home = store.home(store.grid().snap(route.points().front().p_W));
  if (home == kNoTile) throw UsageError("the route's first sample lies in no tile: verify the set");
  return home;
}

}  // namespace

Leg::Leg(const TileStore& store, const RunOptions& options, Route planned, std::uint64_t number,
         const std::optional<CellReach>& its_reach)
    : route(std::move(planned)),
      reach(its_reach),
      home(homeOf(store, route)),
      person(route, options.person, options.seed + number),
      nominal_limit_s(10 * (route.length_um() / (options.zoom_um / Workspace::kZoomSpan_m)) / options.person.speed_m_s +
                      20) {}

}  // namespace filiform::internal
