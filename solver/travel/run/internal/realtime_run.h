// A run in real time: a haptic thread ticks by the clock or the device, IO threads read tiles, and for a tour a thread
// plans the next legs.
#pragma once

#include "solver/travel/run/internal/run_parts.h"

namespace filiform::internal {

// Ticks until the run is over. Calls `on_tick` on the caller's thread, a few milliseconds late. Rows that come faster
// than `on_tick` takes them are lost, counted and noted. Requires placeAtStart(). Throws DeviceError if the loop ended
// by a fault; exceptions from planning and `on_tick` propagate.
void runInRealTime(RunParts& run, const OnTick& on_tick);

}  // namespace filiform::internal
