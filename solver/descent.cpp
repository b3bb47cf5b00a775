#include "solver/descent.h"

#include "solver/internal/bounded_search.h"

namespace filiform {

std::unique_ptr<ProxySolver> makeDescent(const SolverParameters& parameters) {
  return std::make_unique<internal::BoundedSearch>(parameters.max_visited, internal::Reach{});
}

}  // namespace filiform
