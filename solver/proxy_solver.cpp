#include "solver/proxy_solver.h"

#include "index/errors.h"
#include "solver/descent.h"
#include "solver/force_based.h"
#include "solver/internal/bounded_search.h"

#include <cmath>

namespace filiform {

namespace {

void requireNonNegative(double value, const char* name) {
  if (!(value >= 0.0) || !std::isfinite(value))
    throw UsageError(std::string(name) + " is " + std::to_string(value) +
                     ": give a finite number that is not negative");
}

void check(const SolverParameters& parameters) {
  constexpr std::uint32_t kMost = internal::BoundedSearch::kMostVisited;
  if (parameters.max_visited < 1 || parameters.max_visited > kMost)
    throw UsageError("max_visited is " + std::to_string(parameters.max_visited) + " segments a tick: give 1 to " +
                     std::to_string(kMost));
  requireNonNegative(parameters.gain, "gain");
  requireNonNegative(parameters.r_min_um, "r_min_um");
  requireNonNegative(parameters.r_max_um, "r_max_um");
}

}  // namespace

std::unique_ptr<ProxySolver> makeProxySolver(SolverMethod method, const SolverParameters& parameters) {
  check(parameters);
  const char* name = "";
  switch (method) {
    case SolverMethod::basic:
      return makeDescent(parameters);
    case SolverMethod::force:
      return makeForceBased(parameters);
    case SolverMethod::shading:
      name = "shading";
      break;
    case SolverMethod::climb:
      name = "climb";
      break;
  }
  throw UsageError("method '" + std::string(name) + "' is not in this build: choose basic or force");
}

SolverMethod solverMethod(const std::string& name) {
  if (name == "basic") return SolverMethod::basic;
  if (name == "shading") return SolverMethod::shading;
  if (name == "force") return SolverMethod::force;
  if (name == "climb") return SolverMethod::climb;
  throw UsageError("unknown method '" + name + "': choose basic, shading, force or climb");
}

}  // namespace filiform
