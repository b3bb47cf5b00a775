// The hold test: a hand pulls to a place and stays there. Does anything go on moving, and where does the energy come
// from? Functions without state.
#pragma once

#include "tools/lab/evaluate/trial.h"

#include <cstdint>

namespace filiform::tools {

struct HoldResult {
  bool oscillates = false;  // in the last half second the hand still moves by kStill_m, or the proxy by that
  bool late_hop = false;    // in the last half second the proxy moved, once and in one direction
  double energy_J = 0;      // the most that the rendered spring gave more than it had stored, in any 0.1 s
};

inline constexpr double kHold_s = 2.5;  // the pull begins with the run; tremor is off
inline constexpr double kStill_m = 5e-5;

// The proxy begins at t of the segment of that child; the hand's target goes from there to `pull_m` away in 0.1 s and
// stays. Method, hand, stiffness, zoom, rate and delay are those of `setup`. Deterministic.
HoldResult runHold(TrialCell& cell, std::uint32_t child, double t, const Vector3d& pull_m, const TrialSetup& setup);

}  // namespace filiform::tools
