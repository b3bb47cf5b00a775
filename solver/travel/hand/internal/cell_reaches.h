// The reach of the force-based methods in the cells of a set. The other methods have no reach, and nothing is read for
// them. Thread rule: thread-compatible; not for the haptic thread.
#pragma once

#include "index/set/tile_store.h"
#include "solver/proxy/proxy_solver.h"

#include <atomic>
#include <cstdint>
#include <optional>

namespace filiform::internal {

class CellReaches {
 public:
  // The store must outlive the object.
  CellReaches(const TileStore& store, SolverMethod method)
      : store_(store), has_reach_(method == SolverMethod::force || method == SolverMethod::force_listing) {}

  // of(cell) reads nothing.
  bool knows(std::uint32_t cell) const noexcept { return !has_reach_ || cell == cell_; }
  // The reach for NavigationCommand; nullopt: the method has none. Reads all tiles of the cell, unless it is the cell
  // of the last call. Throws as automaticParameters().
  std::optional<CellReach> of(std::uint32_t cell, const std::atomic<bool>* stop = nullptr);

 private:
  const TileStore& store_;
  bool has_reach_;
  std::uint32_t cell_ = UINT32_MAX;  // of the last call
  CellReach reach_;
};

}  // namespace filiform::internal
