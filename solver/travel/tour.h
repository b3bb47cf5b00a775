// A tour: random routes through random cells, one after the other, without end. A person travels one, and jumps to the
// next.
//
//   Tour tour(store, seed);
//   const Route first = tour.next(), second = tour.next();
//
// The routes follow from the set and the seed alone. Only the cells that are visited are read. Thread rule:
// thread-compatible; not for the haptic thread.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/route.h"

#include <cstdint>
#include <optional>
#include <random>
#include <string>

namespace filiform {

class Tour {
 public:
  // Through all cells, each as likely as another, or through `only` one. The store must outlive it.
  Tour(const TileStore& store, std::uint64_t seed, std::optional<std::uint32_t> only = {});

  // The seed of "tour:SEED"; none where `route` is of another kind. Throws UsageError for a seed that is none.
  static std::optional<std::uint64_t> seedOf(const std::string& route);

  // From a random root of a random cell to one of its tips (Route, `random:SEED`). Cells without segments, or whose
  // segments have no length, are passed over. Throws UsageError when a thousand in a row are; what the store throws.
  // Reads the tiles of the cell, and keeps none.
  Route next();

 private:
  const TileStore& store_;
  std::mt19937_64 random_;
  std::optional<std::uint32_t> only_;
};

}  // namespace filiform
