// A headless run: a hand, simulated or recorded, travels a route or a tour through a tile set.
//
//   RunOptions options;
//   options.route = {.kind = RouteChoice::Kind::random, .seed = 3};
//   const RunSummary summary = run(*set, options, [](const TickRow& row) { writeCsvRow(std::cout, row); });
//
// There are two clocks.
//
// Virtual time (the default): the result depends only on the data, the options and the seed, on every machine.
// - With a latency, a tile that is requested at tick k is present at tick k + ceil(latency / period).
// - At latency 0, a tick that meets an absent tile is undone, the tile is loaded, and the tick is repeated before time
//   advances: a *stall*. If the tiles of one tick do not fit the budget together, the tick is a *frontier*: the proxy
//   rests at the absent tile. Without frontiers the rows are bit-identical whatever the budget.
//
// Real time (`realtime`): a haptic thread keeps the clock and IO threads read tiles. An absent tile is a frontier.
// While the tile at which the proxy waits cannot be read, the device is sent zero force.
//
// Tours (route "tour:SEED", see tour.h): one route, a *leg*, after another until the time is over. A leg ends when the
// proxy arrives, when the simulated person gives up, or after 10 times its nominal time and 20 s. The first tile of the
// next leg is then requested. When it is in memory, the hand jumps: the new place comes under the hand, the old force
// fades, and the new force grows over the ramp. In virtual time, legs are planned between ticks; in real time, a thread
// plans ahead.
//
// Replays (device "replay:FILE"): a recorded run is repeated in virtual time, whichever clock it was recorded with. The
// recording carries the options of its run, and a replay takes them (recorded_options.h). A recording of a Session is
// refused.
// With the same set and options its rows are bit-identical, because the recording stores which tiles each tick met
// absent and when jumps were made. Two limits, each noted in RunSummary::notes when it applies:
// - From a tick that met more than six absent tiles, the replay may differ.
// - If the haptic loop was interrupted, the rows have the computed forces, not the forces that were sent. A replay in
//   real time gives the same rows as long as neither run meets a frontier.
//
// Thread rule: function without state; any thread except a haptic thread. Callbacks run on the caller's thread.
#pragma once

#include "device/haptic_device.h"
#include "index/set/tile_store.h"
#include "index/streaming/residency.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/travel/routes/default_cell.h"
#include "solver/travel/routes/simulated_person.h"
#include "solver/travel/run/run_options.h"
#include "solver/travel/run/run_summary.h"
#include "solver/travel/run/tick_row.h"

#include <functional>

namespace filiform {

// Runs until the proxy arrives, the simulated person gives up, the time is over, a replayed recording ends, or `stop`
// is set. Calls `on_tick` once for each tick, in order. The device's last command is zero force, however the run ends.
// Throws UsageError for inconsistent options, an unknown cell or route, and a budget below the minimum; DeviceError
// from the device; IoError and ClosedPipe from the recording; CorruptTile, CorruptSet and IoError from the store.
// Exceptions from `on_tick` propagate.
RunSummary run(const TileStore& store, const RunOptions& options,
               const std::function<void(const TickRow&)>& on_tick = {});

}  // namespace filiform
