#include "solver/travel/run/internal/itinerary.h"

#include "index/query/cell_graph.h"
#include "solver/travel/routes/default_cell.h"

namespace filiform::internal {

Itinerary::Itinerary(const TileStore& store, const RunOptions& options) : store_(store), options_(options) {
  if (const auto seed = Tour::seedOf(options.route)) tour_.emplace(store, *seed, options.cell);
}

std::unique_ptr<Leg> Itinerary::next(const std::atomic<bool>* stop) {
  if (tour_) return std::make_unique<Leg>(store_, options_, tour_->next(stop), legs_++);
  const std::uint32_t cell = options_.cell ? *options_.cell : defaultCell(store_);
  return std::make_unique<Leg>(store_, options_, planRoute(readCell(store_, cell, false, stop), cell, options_.route),
                               0);
}

}  // namespace filiform::internal
