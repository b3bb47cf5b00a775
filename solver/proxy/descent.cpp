#include "solver/proxy/descent.h"

#include "solver/proxy/internal/bounded_search.h"

namespace filiform {

std::unique_ptr<ProxySolver> makeDescent(const SolverParameters& parameters) {
  return std::make_unique<internal::BoundedSearch>(parameters.max_visited, parameters.pool_nodes, internal::Reach{});
}

}  // namespace filiform
