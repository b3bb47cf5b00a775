// Force-based proxy solver: descent that steps over one local maximum (Raya et al. 2011, section 3.3).
//
// The paper gives this method twice, as a text and as a listing, and the two differ. Both are here. h is the probe and
// q the closest point of a segment to h. A segment that has been tested, or a node that has been entered, in the same
// search is *visited*, and is skipped. In both readings r = min(r_max, G |q-h| + r_min), in um of frame W: so the zoom
// changes the feel, as the paper wants. The harder the hand pulls (|q-h|), the longer the step.
//
// ForceReading::text (`--method force`), the text of 3.3. Each branch carries a sub-goal: the nearest point that the
// branch has met, at the distance d_sub from h (at first: none, so d_sub is infinite).
//
//   q at an end node n: stop if n is visited or |q-h| > d_sub. Otherwise q is the new sub-goal, and n is entered.
//   q in the interior:  stop if |q-h| > d_sub. Otherwise q is the new sub-goal, and each unvisited end node n (child,
//                       then parent) with |n-q| < r is entered.
//
// A branch may rise from an interior minimum to one end of its segment. It must then fall below that minimum on the
// very next segments. A proxy that rests *at a node* (a concave elbow) does not escape: from a node, q is that node on
// every segment that rises, and the node is visited. With G = 0 and r_min = 0 what is left is the basic solver.
//
// ForceReading::listing (`--method force-listing`), Algorithms 1 to 3. `dist` is handed from branch to branch, so it is
// the distance of the best point of the whole search so far.
//
//   |q-h| > dist: stop. Otherwise dist = |q-h|, and each unvisited end node n (child, then parent) with |n-q| <= r is
//                 entered, wherever q lies.
//
// So the listing differs in two rules. It tests the spheres of both ends even where q is an end: a proxy that rests at
// a node escapes too. It drops each branch that is not nearer than the best point found on any branch before it.
//
// Where the listing cannot be taken by the letter: it writes "dist' = dist" where dist = dist' is meant (by the letter
// the proxy would never move), and it never marks what it calls visited: each procedure marks on entry, as 3.1 says.
// Both readings: segments in the order of identity; a segment of equal ends is transparent, passed without a test and
// with the sub-goal unchanged. Section 3.1 starts a new sub-goal at each node; 3.3 keeps the branch's sub-goal over it
// ("will not continue beyond the first node"), and so do both readings here.
//
// Bounds, resuming, frontiers and invariants: internal/bounded_search.h. Thread rule: haptic thread only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <cstdint>
#include <memory>

namespace filiform {

enum class ForceReading : std::uint8_t { text, listing };

// makeProxySolver() has checked the parameters.
std::unique_ptr<ProxySolver> makeForceBased(const SolverParameters& parameters, ForceReading reading);

}  // namespace filiform
