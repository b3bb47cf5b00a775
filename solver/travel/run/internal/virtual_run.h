// A run in virtual time: each tick takes one period, however long its computation takes.
#pragma once

#include "solver/travel/run/internal/run_parts.h"

namespace filiform::internal {

// Ticks until the run is over, on the caller's thread. Requires placeAtStart(). Exceptions from the store, the
// recording and `on_tick` propagate.
void runInVirtualTime(RunParts& run, const OnTick& on_tick);

}  // namespace filiform::internal
