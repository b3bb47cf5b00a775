// What Navigation::tick costs as the haptic loop calls it: single ticks, prepare() after each, outside of what is
// timed. Functions without state.
#pragma once

#include "tools/lab/bench/solver_scenes.h"

namespace filiform::tools {

// Adds the table, its samples, goals and notes. Every method on every walk, with the pool of decoded nodes and without
// one, by turns. Throws std::logic_error if the pool changes a place or a force.
void measureNavigationTicks(const std::vector<SolverScene>& scenes, const BenchOptions& options, BenchReport& report);

}  // namespace filiform::tools
