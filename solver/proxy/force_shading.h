// Force shading: the proxy goes to the nearest point to a *sub-goal* that lies on the shaded line through the proxy
// (Ruspini et al. 1997, extended to branches by Raya et al. 2011). A baseline for comparisons.
//
// Ruspini shades in two passes: the interpolated constraint gives a sub-goal, and the real geometry then takes the
// proxy to the sub-goal. On a neurite, the constraint is a line. Its direction is interpolated between the directions
// at the two ends of the proxy's segment, so that it turns evenly along the neurite instead of at corners:
//
//   up to kShadingPasses times in a tick, until p moves by no more than 1e-9 um:
//     p at t of the segment from A to B:  d = ((1-t) d_A + t d_B), normalized;  sub-goal = p + d (d . (h - p))
//     p = the place to which the basic solver (descent.h) goes from p if the sub-goal is its probe
//   d_A, d_B: mean of the unit directions of up to three segments at the end, each oriented through the node: this
//   segment, and the two others whose closest points to h are nearest (ties: lower id)
//
// The paper says only that three segments are selected dynamically, by proximity. Other readings complete less
// (solver/RESULTS.md, "Readings of force shading").
//
// A segment of length zero has no direction and does not count in the mean. Without a direction, the sub-goal is h. A
// node whose home is absent is a frontier: it is reported, and its direction is that of the segment. The passes look at
// no more than max_visited segments for directions, and the descents test no more than max_visited; a tick that reaches
// one of these bounds is capped. The field of directions is not a gradient. The distance to h may rise, the proxy may
// jump, and with h at rest it may go in circles.
//
// Invariants (each has a test): results equal a literal oracle, bit for bit, in every tiling; the bounds hold; undo()
// is exact; repeating undo, load and tick converges to the whole graph's answer; a probe that is not finite changes
// nothing. Thread rule: haptic thread only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <memory>

namespace filiform {

inline constexpr std::uint32_t kShadingPasses = 16;  // most in a tick

// Uses only max_visited and pool_nodes. Requires checked parameters, as makeProxySolver() does. About 5 MB at the
// default.
std::unique_ptr<ProxySolver> makeForceShading(const SolverParameters& parameters);

}  // namespace filiform
