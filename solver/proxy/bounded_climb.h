// Bounded climb: the proxy goes to the nearest point that it can reach within a budget of climbing.
//
// The method is a uniform-cost search over *uphill arc length*. Travel along the neurites costs nothing while the
// distance to the probe h falls. It costs its arc length while that distance rises. Among all points reached at a cost
// <= r, the point nearest to h wins. So the proxy passes any number of local minima, at elbows, at branches and between
// them, but it never leaps to an unconnected neurite. Lengths are millimetres of the device, so the feel does not
// depend on the zoom.
//
//   tick(h, dt, scale):                    p: the proxy; m: the patience budget; v: what p moved since the last tick
//     m = max(0, m - cost (1 + growth m) v)
//     |p - h| > pull:    m = m + patience (1 + growth m) min(|p - h| - pull, most_pull) dt     the hand keeps pulling
//     otherwise:         m = m max(0, 1 - dt / 0.2 s)
//     m = min(m, most)
//   search:
//     S = p's segment;  q = closest point of S to h;  best = q, or p if q is not nearer
//     r = leap min(most, rest + gain |best - h| + m), constant during the tick
//     offer S's ends; on S, only the part that rises between p, q and the end costs
//     pop the node n of lowest cost (ties: lower id); for each segment S' at n, in the order of ids, not tested yet:
//       work == max_visited: capped; the best so far is the answer
//       w = closest point of S' to h;  if w is nearer than best by more than eps: best = w
//       c = cost(n) + |o - w| at the other end o: the distance falls from n to w and rises from w to o
//       follow: while exactly two segments meet at o, c <= r, and the next segment holds no better point: add its
//       climb to c, and go on to its other end
//       offer o at c
//     eps = max(1e-9 um, 1e-12 of the distance): a smaller improvement is rounding
//
// Choice of parameters: two branches leave a fork at an angle a, and the proxy is at a distance x past the fork on the
// wrong branch. To leave, it must climb x, with a pull of at most a x. It leaves at once if x <= rest / (1 - gain a),
// and needs patience beyond. Nearly parallel branches (a < 0.3), and hands whose aim is wrong by more than a x, need
// `rest` and patience. Wide forks need neither.
//
// *Work* is the number of tested segments, where 16 segments that were followed count as one: to follow a segment takes
// no label, no place in the queue and no search for its node. So the reach of a tick depends little on how finely
// a cell was sampled. Following changes no answer: it passes only segments that cannot hold the best point, and in a
// run, costs are summed in the same order.
//
// A segment of length zero costs nothing and is passed. If max_visited cuts the list of a node's branches, the next
// tick that reaches this node continues with the branch that was cut, and wraps around.
//
// *Hubs*: the first node with more than 16 branches, and more than half of the work that is left. To test a branch
// there counts as two, because it is read from the tile. So no tick tests them all. Every second tick that comes to the
// hub looks at its branches (internal/hub_branches.h) for half of this work, and goes down the 16 that point most
// nearly to the hand. They are kept from tick to tick: all branches are looked at within degree / (2 max_visited) + 1
// such ticks. The other ticks test the branches in turn: each within 4 degree / (max_visited - tests before the hub) +
// 2 ticks.
//
// Invariants (each has a test):
// 1. |p - h| never rises within a tick. It falls by more than eps if p leaves its segment, so at a fixed h the proxy
//    never goes in cycles.
// 2. p stays on the neurites. The path from the old p to the new p rises by at most r in all.
// 3. With rest = gain = patience = 0 and below the cap, the search reaches every point that the basic solver
//    (descent.h) can reach, and takes the best of them to within eps.
// 4. Work <= max_visited; offered nodes <= work + 1; repeated looks at tested segments <= 2 work.
// 5. Below the cap, the result depends on ids, not on tiling. It never depends on memory or on other tiles in memory: a
//    run is followed only within a tile, so the cap is reached a little earlier with small tiles. A node whose home is
//    absent offers nothing and is reported; the first reported tile is always needed. Repeating undo(), load and the
//    same tick until no tile is absent gives the answer of the whole graph, bit for bit.
// 6. undo() restores everything that is kept between ticks, bit for bit.
// 7. A probe that is not finite changes nothing.
//
// The proxy may jump; the anchor (anchor.h) keeps the force continuous. From one tick to the next the solver keeps only
// the place, the patience, the position in the cut list and the branches of a hub. Thread rule: haptic thread only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <memory>

namespace filiform {

// Requires checked parameters, as makeProxySolver() does. About 0.3 MB at the default cap, beside the pool; grows with
// the cap.
std::unique_ptr<ProxySolver> makeBoundedClimb(const SolverParameters& parameters);

}  // namespace filiform
