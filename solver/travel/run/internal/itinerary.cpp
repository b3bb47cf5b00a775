#include "solver/travel/run/internal/itinerary.h"

#include "index/errors.h"
#include "index/query/cell_graph.h"
#include "solver/travel/routes/default_cell.h"
#include "solver/workspace/workspace.h"

#include <cstdio>
#include <utility>

namespace filiform::internal {

Itinerary::Itinerary(const TileStore& store, const RunOptions& options)
    : store_(store), options_(options), reaches_(store, options.method) {
  if (options.route.kind == RouteChoice::Kind::tour) tour_.emplace(store, options.route.seed, options.cell);
}

std::unique_ptr<Leg> Itinerary::next(const std::atomic<bool>* stop) {
  constexpr int kMostPassedOver = 100;
  const double tolerance_um = options_.person.arrive_m * options_.zoom_um / Workspace::kZoomSpan_m;
  double length_um = 0;
  for (int passed_over = 0; passed_over <= (tour_ ? kMostPassedOver : 0); ++passed_over) {
    Route route = tour_ ? tour_->next(stop) : planned(stop);
    length_um = route.length_um();
    if (!(length_um > tolerance_um)) continue;
    const std::optional<CellReach> reach = options_.solver ? std::nullopt : reaches_.of(route.cell(), stop);
    return std::make_unique<Leg>(store_, options_, std::move(route), tour_ ? legs_++ : 0, reach);
  }
  char text[160];
  std::snprintf(
      text, sizeof text,
      "a route of %.4g um is too short for a zoom of %g um, at which a hand has arrived %.4g um before the end: "
      "choose a smaller zoom",
      length_um, options_.zoom_um, tolerance_um);
  throw UsageError(text);
}

Route Itinerary::planned(const std::atomic<bool>* stop) const {
  const std::uint32_t cell = options_.cell ? *options_.cell : defaultCell(store_);
  return planRoute(readCell(store_, cell, false, stop), cell, options_.route);
}

}  // namespace filiform::internal
