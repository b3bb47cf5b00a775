#include "index/errors.h"
#include "index/text.h"
#include "solver/proxy/bounded_climb.h"
#include "solver/proxy/descent.h"
#include "solver/proxy/force_based.h"
#include "solver/proxy/force_shading.h"
#include "solver/proxy/internal/bounded_search.h"
#include "solver/proxy/proxy_solver.h"

#include <cmath>

namespace filiform {

namespace {

void requireNonNegative(double value, const char* name) {
  if (!(value >= 0.0) || !std::isfinite(value))
    throw UsageError(std::string(name) + " is " + std::to_string(value) +
                     ": give a finite number that is not negative");
}

void checkParameters(const SolverParameters& parameters) {
  constexpr std::uint32_t kMost = internal::BoundedSearch::kMostVisited;
  if (parameters.max_visited < 1 || parameters.max_visited > kMost)
    throw UsageError("max_visited is " + std::to_string(parameters.max_visited) + " segments a tick: give 1 to " +
                     std::to_string(kMost));
  if (parameters.pool_nodes > kMost)
    throw UsageError("pool_nodes is " + std::to_string(parameters.pool_nodes) + ": give at most " +
                     std::to_string(kMost));
  requireNonNegative(parameters.gain, "gain");
  requireNonNegative(parameters.r_min_um, "r_min_um");
  requireNonNegative(parameters.r_max_um, "r_max_um");
  requireNonNegative(parameters.climb.rest_mm, "rest_mm");
  requireNonNegative(parameters.climb.gain, "the climb's gain");
  requireNonNegative(parameters.climb.most_mm, "most_mm");
  requireNonNegative(parameters.climb.patience_1_s, "patience_1_s");
  requireNonNegative(parameters.climb.pull_mm, "pull_mm");
  requireNonNegative(parameters.climb.most_pull_mm, "most_pull_mm");
  requireNonNegative(parameters.climb.growth_1_mm, "growth_1_mm");
  requireNonNegative(parameters.climb.motion_cost, "motion_cost");
}

}  // namespace

std::unique_ptr<ProxySolver> makeProxySolver(SolverMethod method, const SolverParameters& parameters) {
  checkParameters(parameters);
  switch (method) {
    case SolverMethod::basic:
      return makeDescent(parameters);
    case SolverMethod::shading:
      return makeForceShading(parameters);
    case SolverMethod::force:
      return makeForceBased(parameters, ForceReading::text);
    case SolverMethod::force_listing:
      return makeForceBased(parameters, ForceReading::listing);
    case SolverMethod::climb:
      return makeBoundedClimb(parameters);
  }
  throw UsageError("unknown solver method");
}

const char* toString(SolverMethod method) noexcept {
  switch (method) {
    case SolverMethod::basic:
      return "basic";
    case SolverMethod::shading:
      return "shading";
    case SolverMethod::force:
      return "force";
    case SolverMethod::force_listing:
      return "force-listing";
    case SolverMethod::climb:
      return "climb";
  }
  return "unknown";
}

SolverMethod solverMethod(const std::string& name) {
  for (const SolverMethod method : kSolverMethods)
    if (name == toString(method)) return method;
  throw UsageError("unknown method '" + inShort(name) + "': choose basic, shading, force, force-listing or climb");
}

}  // namespace filiform
