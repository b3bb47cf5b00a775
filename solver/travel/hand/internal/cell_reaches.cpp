#include "solver/travel/hand/internal/cell_reaches.h"

#include "solver/proxy/parameters.h"

namespace filiform::internal {

std::optional<CellReach> CellReaches::of(std::uint32_t cell, const std::atomic<bool>* stop) {
  if (!has_reach_) return std::nullopt;
  if (cell != cell_) {
    const SolverParameters parameters = automaticParameters(store_, cell, stop);
    reach_ = {parameters.r_min_um, parameters.r_max_um};
    cell_ = cell;
  }
  return reach_;
}

}  // namespace filiform::internal
