// The legs of a run in sequence: one route, or the routes of a tour. Thread rule: thread-compatible; not for the haptic
// thread.
#pragma once

#include "solver/travel/hand/internal/cell_reaches.h"
#include "solver/travel/routes/tour.h"
#include "solver/travel/run/internal/leg.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

namespace filiform::internal {

class Itinerary {
 public:
  // Store and options must outlive the object.
  Itinerary(const TileStore& store, const RunOptions& options);

  bool isTour() const { return tour_.has_value(); }

  // Plans the next leg; for a single route, the same leg each time. A tour passes over a route at whose start a hand
  // has arrived already: it is not longer than PersonParameters::arrive_m at this zoom. Throws UsageError for a single
  // route like this, or if a tour finds no other. Reads a cell, or several. Throws as readCell(), planRoute(),
  // Tour::next() and Leg do.
  std::unique_ptr<Leg> next(const std::atomic<bool>* stop = nullptr);

 private:
  Route planned(const std::atomic<bool>* stop) const;
  const TileStore& store_;
  const RunOptions& options_;
  CellReaches reaches_;
  std::optional<Tour> tour_;
  std::uint64_t legs_ = 0;
};

}  // namespace filiform::internal
