// Force-based proxy solver: descent that steps over one local maximum (Raya et al. 2011, section 3.3; DESIGN 5.2).
//
// As the basic solver (descent.h), with a sub-goal carried along each branch: the nearest point that the branch has
// met, at the distance d_sub from the probe h (at first: none, so d_sub is infinite).
//
//   q at an unvisited end node n: go on from n only if |q-h| <= d_sub; q is the new sub-goal.
//   q in the interior:            stop if |q-h| > d_sub. Otherwise q is the new sub-goal, and for each unvisited end
//   node n (child,
//                                 then parent) with |n-q| < r, go on from n, *keeping* the sub-goal q.
//   r = min(r_max, G |q-h| + r_min), all in um of frame W: the zoom changes the feel, as the paper wants.
//
// So a branch may rise from an interior minimum to one end of its segment, and must then fall below that minimum on the
// very next segments: at most one local maximum is stepped over at a time. The harder the hand pulls (|q-h|), the
// longer the step. A proxy that rests *at a node* (a concave elbow) does not escape: the paper's rule climbs from
// interiors only. A segment of equal ends is transparent: passed without the test and with the sub-goal unchanged. With
// G = 0 and r_min = 0 no step is allowed, and what is left is the basic solver.
//
// Bounds, resuming, frontiers and invariants: internal/bounded_search.h. Thread rule: haptic thread only.
#pragma once

#include "solver/proxy_solver.h"

#include <memory>

namespace filiform {

// makeProxySolver() has checked the parameters.
std::unique_ptr<ProxySolver> makeForceBased(const SolverParameters& parameters);

}  // namespace filiform
