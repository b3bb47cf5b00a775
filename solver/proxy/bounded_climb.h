// Bounded climb: the proxy goes to the nearest point that lies within a budget of climbing (DESIGN 5.4).
//
// Uniform-cost search over *uphill arc length*. Travel along the structure is free while the distance to the probe h
// falls, and costs its arc length while it rises; everything that is reached at a cost <= r competes, and the nearest
// to h wins. So any number of local minima is passed, at elbows, branches and along them, but never by a leap to a
// neurite that is not connected. All in device millimetres, so that the feel does not depend on the zoom:
//
//   tick(h, dt, scale):                    p: the proxy; m: the patience budget; a: where it began
//     |p - a| > reset:   m = 0, a = p
//     |p - h| > pull:    m = min(m + patience (|p - h| - pull) dt, most)      a hand that keeps pulling wants out
//     otherwise:         m = m max(0, 1 - dt / 0.2 s)
//   search:
//     S = p's segment;  q = closest point of S to h;  the best is q, or p where q is not nearer
//     r = min(most, rest + gain |best - h| + m), fixed for the tick
//     offer S's ends: of S only what rises between p, q and the end costs
//     pop the node n of least cost (ties: lower identity); for S' incident on n, in the order of identity, not tested
//     yet:
//       tested == max_visited: capped, the best so far is the answer
//       w = closest point of S' to h;  nearer than the best by more than eps: it is the best
//       offer the other end o at cost(n) + |o - w|: from n to w falls, from w to o rises
//     eps = 1e-9 um, or 1e-12 of the distance where that is more: rounding is no progress
//
// How the parameters were chosen: where two branches leave a fork at an angle a, a proxy that is x past the fork on the
// wrong branch must climb x to leave it, and the pull is at most a x. So it leaves at once while
// x <= rest / (1 - gain a), and needs patience beyond. Nearly parallel branches (a < 0.3) and a hand whose aim is wrong
// by more than a x need the rest and the patience; wide forks need neither.
//
// A segment of equal ends costs nothing: it is passed. Where max_visited cuts a node's branches, the next tick that
// comes to this node goes on with the branch that was cut, and round: every branch of a hub is seen within
// degree / (max_visited - what is tested before it) + 1 ticks.
//
// Invariants (each a test):
//  1. |p - h| never rises within a tick, and falls by more than eps where p leaves its segment: at fixed h no cycle.
//  2. p stays on the structure, and is reached from the old p over a path that rises by at most r in all.
//  3. With rest = gain = patience = 0 and below the cap every point that the basic solver (descent.h) can reach is
//     reached, and the best of them taken, to within eps.
//  4. Tested segments <= max_visited; nodes offered <= tested + 1; looks at segments tested already <= 2 tested.
//  5. It depends on identities, not on tiling, memory or which tiles happen to be resident. A node whose home is absent
//     offers nothing and is reported; the first one reported is always needed. undo(), load, the same tick again, until
//     nothing is absent: the answer of the whole graph, bit for bit.
//  6. undo() restores place, patience and cursor, bit for bit.
//  7. A probe that is not finite changes nothing.
//
// The proxy may jump; what keeps the force from jumping with it is the anchor (anchor.h). Nothing is left over for the
// next tick but the place, the patience and the cursor. Thread rule: haptic thread only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <memory>

namespace filiform {

// makeProxySolver() has checked the parameters. About 60 KB at the default cap, in proportion to it beyond.
std::unique_ptr<ProxySolver> makeBoundedClimb(const SolverParameters& parameters);

}  // namespace filiform
