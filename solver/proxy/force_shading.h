// Force shading: the proxy is where the *shaded* direction of the neurite is perpendicular to the pull (Ruspini et al.
// 1997, extended to branches by Raya et al. 2011). A baseline for comparisons.
//
// The closest point of a segment satisfies (h - p) . d = 0. Here the direction d is interpolated between directions at
// the segment's two ends, so that it turns evenly along the neurite instead of at corners. On the segment from A to B,
// with p(u) = A + u (B - A):
//
//   f(u) = (h - p(u)) . ((1-u) d_A + u d_B)     a quadratic in u, solved exactly; f > 0: move towards B
//   d_A, d_B: mean of the unit directions of up to three segments at the end, each oriented through the node: this
//   segment, and the two others whose closest points to h are nearest (ties: lower id)
//
// From the old u the proxy moves in the direction that f gives, to the first zero of f. If there is no zero before an
// end of the segment, the proxy leaves by that node: into the segment that is nearest to h, if f there leads away from
// the node. Otherwise it rests at the node. A tick walks at most kMostShadedSegments segments and looks at no more than
// max_visited segments at nodes. When the looks are used up, the tick is capped: the next tick continues from there.
//
// A segment of length zero has no direction and does not count in the mean; if it is the nearest segment, it is passed.
// A node whose home is absent is a frontier: it is reported, its direction is that of the segment, and the proxy does
// not leave by it. The field of directions is not a gradient. The distance to h may rise, the proxy may jump, and with
// h at rest it may go in circles, a bounded number of segments a tick.
//
// Invariants (each has a test): results equal a literal oracle, bit for bit, in every tiling; the bounds hold; undo()
// is exact; repeating undo, load and tick converges to the whole graph's answer; a probe that is not finite changes
// nothing. Thread rule: haptic thread only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <memory>

namespace filiform {

inline constexpr std::uint32_t kMostShadedSegments = 64;

// Uses only max_visited and pool_nodes. Requires checked parameters, as makeProxySolver() does. SolverStep::visited
// counts the segments on which f was solved.
std::unique_ptr<ProxySolver> makeForceShading(const SolverParameters& parameters);

}  // namespace filiform
