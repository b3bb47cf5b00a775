// A run in real time: a haptic thread ticks by the clock or the device, IO threads read tiles, and for a tour a thread
// plans the next legs.
#pragma once

#include "solver/travel/internal/run_parts.h"

namespace filiform::internal {

// Ticks until the run is over. `on_tick` comes on the caller's thread, a few milliseconds late; rows that come faster
// than `on_tick` takes them are lost, counted and noted. Requires placeAtStart(). Throws DeviceError for a loop that
// ended by a fault, and what planning and `on_tick` throw.
void runInRealTime(RunParts& run, const OnTick& on_tick);

}  // namespace filiform::internal
