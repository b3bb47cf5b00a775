// A tour: an endless sequence of random routes through random cells. A simulated person travels one route, then jumps
// to the next.
//
//   Tour tour(store, seed);
//   const Route first = tour.next(), second = tour.next();
//
// The routes depend only on the set and the seed. Only the cells of these routes are read. Thread rule:
// thread-compatible; not for the haptic thread.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/routes/route.h"

#include <atomic>
#include <cstdint>
#include <optional>
#include <random>

namespace filiform {

class Tour {
 public:
  // Chooses among all cells with equal probability; with `only`, stays in one cell. The store must outlive the tour.
  Tour(const TileStore& store, std::uint64_t seed, std::optional<std::uint32_t> only = {});

  // Plans a route from a random root of a random cell to one of its tips (RouteChoice::Kind::random). Skips
  // cells without segments, and cells whose segments have no length. Throws UsageError after a thousand such cells in a
  // row, and as readCell() does. Reads the tiles of the cell and keeps none.
  Route next(const std::atomic<bool>* stop = nullptr);

 private:
  const TileStore& store_;
  std::mt19937_64 random_;
  std::optional<std::uint32_t> only_;
};

}  // namespace filiform
