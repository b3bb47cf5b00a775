// The hold test: a hand pulls to a place and stays there. Measures whether anything keeps moving, and how much energy
// the spring gives. Functions without state.
#pragma once

#include "tools/lab/evaluate/trials/trial.h"

#include <cstdint>

namespace filiform::tools {

struct HoldResult {
  bool oscillates = false;  // in the last half second the hand or the proxy still moves by kStill_m, back and forth
  bool late_hop = false;    // in the last half second the proxy moved, once and in one direction
  double energy_J = 0;      // largest energy that the rendered spring gave beyond its stored energy, in any 0.1 s
};

inline constexpr double kHold_s = 2.5;  // duration; the pull begins at once; no tremor
inline constexpr double kStill_m = 5e-5;

// The proxy begins at t of the segment with this child. The hand's target moves from there by `pull_m` in 0.1 s and
// stays. `setup` gives method, hand, stiffness, zoom, rate and delay. Deterministic.
HoldResult runHold(TrialCell& cell, std::uint32_t child, double t, const Vector3d& pull_m, const TrialSetup& setup);

}  // namespace filiform::tools
