// The oracle of the evaluation: a "solver" whose proxy is always the nearest point of the connected cell. It is never
// stuck and its force is a lower bound, but it leaps between neurites that are not connected nearby. It works only on a
// TrialCell. Thread rule: as ProxySolver.
#pragma once

#include "solver/proxy/proxy_solver.h"
#include "tools/lab/evaluate/trials/trial_cell.h"

#include <memory>

namespace filiform::tools {

// The cell must outlive it.
std::unique_ptr<ProxySolver> makeNearestOracle(TrialCell& cell);

}  // namespace filiform::tools
