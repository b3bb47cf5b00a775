// Times Navigation::tick as the haptic loop calls it: single ticks, with prepare() after each, which is not timed.
// Thread rule: functions without state.
#pragma once

#include "tools/lab/bench/solver/solver_scenes.h"

namespace filiform::tools {

// Times every method on every walk, with the pool of decoded nodes and without it, in turn. Adds a table, its samples
// and its goals to the report. Throws std::logic_error if the pool changes a place or a force.
void measureNavigationTicks(const std::vector<SolverScene>& scenes, const BenchOptions& options, BenchReport& report);

}  // namespace filiform::tools
