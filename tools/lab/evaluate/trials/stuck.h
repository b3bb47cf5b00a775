// Why a proxy is stuck: whether any solver could have moved it, and what that would have needed. Functions without
// state.
#pragma once

#include "solver/proxy/proxy_solver.h"
#include "tools/lab/evaluate/trials/trial_cell.h"

namespace filiform::tools {

// Returns true if no point of the connected tree is nearer to the probe than the proxy. Then no solver that answers
// with the nearest reachable point can move; only a change of hand or stiffness helps. Usually O(log n).
bool inherentlyStuck(TrialCell& cell, const ProxyPlace& place, const Vector3d& h_W);

// Returns the least climb, um: on the way along the structure from the place to a point nearer to the probe, the arc
// length over which the distance to the probe rises. Infinite if the proxy is inherently stuck. O(n log n).
double leastClimb_um(TrialCell& cell, const ProxyPlace& place, const Vector3d& h_W);

}  // namespace filiform::tools
