#include "solver/force_based.h"

#include "solver/internal/bounded_search.h"

namespace filiform {

std::unique_ptr<ProxySolver> makeForceBased(const SolverParameters& parameters) {
  const internal::Reach reach{true, parameters.gain, parameters.r_min_um, parameters.r_max_um};
  return std::make_unique<internal::BoundedSearch>(parameters.max_visited, reach);
}

}  // namespace filiform
