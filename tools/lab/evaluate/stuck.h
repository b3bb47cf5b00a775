// Why a proxy is stuck: whether any solver could have moved it, and what it would have taken. Functions without state.
#pragma once

#include "solver/proxy/proxy_solver.h"
#include "tools/lab/evaluate/trial_cell.h"

namespace filiform::tools {

// True where no point of the connected tree is nearer to the probe than the proxy: then no solver that answers with the
// nearest point that it can reach moves, whatever its reach; only the hand or the stiffness can. O(log n) as a rule.
bool inherentlyStuck(TrialCell& cell, const ProxyPlace& place, const Vector3d& h_W);

// The least arc length (um) that the distance to the probe rises over on the way along the structure from the place to
// any point nearer to the probe; falling is free. Infinite where it is inherently stuck. O(n log n).
double leastClimb_um(TrialCell& cell, const ProxyPlace& place, const Vector3d& h_W);

}  // namespace filiform::tools
