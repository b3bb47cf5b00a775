// Force-based proxy solver: descent that steps over one local maximum (Raya et al. 2011, section 3.3).
//
// The paper gives this method twice, as text and as a listing, and the two differ. Both variants are here. h is the
// probe, and q the closest point of a segment to h. In one search, a tested segment and an entered node are *visited*,
// and are skipped. Both variants use r = min(r_max, G |q-h| + r_min), in um of frame W. So the zoom changes the feel,
// as the paper intends: the harder the hand pulls (|q-h|), the longer the step.
//
// ForceReading::text (`--method force`), the text of 3.3. Each branch carries a sub-goal: the nearest point so far on
// the branch, at the distance d_sub from h (infinite at the start).
//
//   q at an end node n: stop if n is visited or |q-h| >= d_sub. Otherwise q is the new sub-goal, and n is entered.
//   q in the interior:  stop if |q-h| >= d_sub. Otherwise q is the new sub-goal, and each unvisited end node n (child,
//                       then parent) with |n-q| < r is entered.
//
// So a branch may rise from an interior minimum to one end of its segment. It must fall below that minimum on the very
// next segments. A proxy that rests *at a node* (a concave elbow) does not escape: on every segment that rises from the
// node, q is the node itself, which is visited. With G = 0 and r_min = 0 the method equals the basic solver.
//
// ForceReading::listing (`--method force-listing`), Algorithms 1 to 3. `dist` is passed from branch to branch, so it is
// the distance of the best point of the whole search so far.
//
//   |q-h| > dist: stop. Otherwise dist = |q-h|, and each unvisited end node n (child, then parent) with |n-q| <= r is
//                 entered, wherever q lies.
//
// So the listing differs in three rules. It tests the spheres of both ends even if q is an end: a proxy that rests at a
// node escapes too. It drops each branch that is farther than the best point found on any branch before it. It goes on
// at an equal distance.
//
// The listing cannot be taken literally in two places. It writes "dist' = dist" but must mean dist = dist' (literally,
// the proxy would never move). It never marks the elements that it calls visited; here each procedure marks on entry,
// as 3.1 says. In both variants, segments are taken in the order of their ids, and a segment of length zero is passed
// without a test, with the sub-goal unchanged. Section 3.1 starts a new sub-goal at each node. Section 3.3 keeps the
// branch's sub-goal over a node ("will not continue beyond the first node"), and so do both variants here.
//
// Bounds, continuation in later ticks, frontiers and invariants: internal/bounded_search.h. Thread rule: haptic thread
// only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <cstdint>
#include <memory>

namespace filiform {

enum class ForceReading : std::uint8_t { text, listing };

// Requires checked parameters, as makeProxySolver() does.
std::unique_ptr<ProxySolver> makeForceBased(const SolverParameters& parameters, ForceReading reading);

}  // namespace filiform
