#include "solver/proxy/force_based.h"

#include "solver/proxy/internal/bounded_search.h"

namespace filiform {

std::unique_ptr<ProxySolver> makeForceBased(const SolverParameters& parameters, ForceReading reading) {
  const internal::Escape escape = reading == ForceReading::text ? internal::Escape::text : internal::Escape::listing;
  const internal::Reach reach{escape, parameters.gain, parameters.r_min_um, parameters.r_max_um};
  return std::make_unique<internal::BoundedSearch>(parameters.max_visited, parameters.pool_nodes, reach);
}

}  // namespace filiform
