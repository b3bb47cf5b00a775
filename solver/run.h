// A headless navigation run: a hand, simulated or recorded, travels a route through a tile set.
//
// In virtual time (the default) the outcome depends on the data, the options and the seed, not on the machine. A tile
// asked for at tick k is there at tick k + ceil(latency / dt). With latency 0 a tick that meets an absent tile is taken
// back, its tiles are loaded, and it is repeated before time advances: one *stall*; only a tick whose tiles do not fit
// the budget together is a *frontier*. So a run's rows are bit-identical whatever the budget as long as it meets no
// frontier. In real time (`realtime`) a haptic thread keeps the clock, an IO thread reads, and an absent tile is always
// a frontier; while the tile that the proxy waits for cannot be read, the device is sent zero force. Thread rule:
// functions without state; any thread but a haptic one. on_tick is called on the caller's thread.
#pragma once

#include "device/haptic_device.h"
#include "index/residency.h"
#include "index/tile_store.h"
#include "solver/loop_metrics.h"
#include "solver/passivity.h"
#include "solver/proxy_solver.h"
#include "solver/simulated_person.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

struct NavigationSnapshot;

struct RunOptions {
  std::optional<std::uint32_t> cell;  // none: the cell of most segments (ties: name)
  std::string route = "longest";      // see planRoute; or tour:SEED, see Tour: through `cell`, or all cells
  std::optional<double> seconds;      // simulated time at most; none: 10 times nominal + 20 s, of a tour 60 s
  SolverMethod method = SolverMethod::climb;
  std::optional<SolverParameters> solver;  // none: automatic, from the cell
  std::string device = "sim:medium";       // see makeDevice; a simulated hand is led by a simulated person
  std::optional<double> stiffness_N_m;     // none: 200, 50 with the loose hand; hardware as defaultStiffness()
  // The passivity controller. None: on where the stiffness is not within the stability bound of hand and device, or
  // their damping is unknown.
  std::optional<bool> passivity;
  double zoom_um = 300;  // world across 0.12 m of device
  double rate_Hz = 1000;
  int delay_samples = 1;    // of the simulated hand: 0, 1 or 2
  PersonParameters person;  // its speed_m_s is the aim's
  std::uint64_t seed = 1;   // of the person's tremor
  // The store holds its tiles in memory (a small scene): no residency, budget or latency; nothing is read or evicted.
  bool in_memory = false;
  std::optional<std::uint64_t> budget_bytes;  // none: unlimited
  double latency_ms = 0;                      // virtual time only
  PrefetchPolicy prefetch =
      PrefetchPolicy::structure;  // with latency or in real time; at latency 0 tiles come on demand only
  unsigned io_threads = 1;        // in real time
  bool realtime = false;
  std::string record;          // file that replay:FILE reads; empty: none
  std::string record_options;  // kept in it, for who repeats the run; of no meaning here
  // Makes `device`, not opened, from its name and the period in s; none: makeDevice().
  std::function<std::unique_ptr<HapticDevice>(const std::string&, double)> make_device{};
  // In virtual time only: after each tick, on the caller's thread, what the eye should know.
  std::function<void(const NavigationSnapshot&)> on_snapshot{};
  // In real time: before its threads are waited for, which a read that hangs can hold up. May not throw.
  std::function<void()> ending{};
  std::string fault_csv;  // in real time: where the last ticks go if the loop ends by a fault; empty: nowhere
  // When it becomes true the run ends after the tick under way, with the outcome `interrupted`. None: nothing does.
  const std::atomic<bool>* stop = nullptr;
  // A run that failed or was interrupted leaves an older file at `record` as it is, and keeps what was recorded beside
  // it: called with that name.
  std::function<void(const std::string& path)> recording_kept{};
};

enum class RunOutcome {
  completed,    // the proxy was within the person's arrive_m of the tip, or a tour's time is over
  stuck,        // the person gave up, or the recording that is replayed ended, before the tip
  time_over,    // the time for a route was over before the tip
  interrupted,  // RunOptions::stop
};
const char* toString(RunOutcome outcome);  // the enumerator's name: the word in JSON, text and pictures

// One row of the CSV.
struct TickRow {
  std::uint64_t tick = 0;  // from 0
  double time_s = 0;
  Vector3d h_W = Vector3d::Zero();            // probe, um
  Vector3d p_W = Vector3d::Zero();            // proxy, um
  SegmentId segment{UINT32_MAX, UINT32_MAX};  // the proxy's
  Vector3d force_N = Vector3d::Zero();        // frame D
  std::uint32_t visited = 0;                  // segments tested
  bool frontier = false;
};

struct LoopReport {  // of the haptic loop, see haptic_loop.h
  LoopMetrics metrics{0};
  std::uint64_t stale_ticks = 0, interruptions = 0, guard_exchanges = 0;
};

struct RunSummary {
  // As `navigate --json` has them.
  RunOutcome outcome = RunOutcome::stuck;
  double route_um = 0, reached_um = 0;  // arc length of the route, and of it so far as RouteTracker counts it; of a
                                        // tour: of all its legs together
  std::uint64_t ticks = 0;
  double sim_s = 0;
  std::uint64_t segments = 0;  // links kept in the whole set
  std::uint64_t tiles = 0;     // distinct tiles that the solver read
  std::uint64_t tiles_read = 0, evictions = 0;
  std::uint64_t stalls = 0, frontiers = 0;  // ticks
  std::uint64_t peak_bytes = 0;
  std::optional<std::uint64_t> budget_bytes;                        // none: unlimited
  std::uint64_t decoded_bytes = 0;                                  // of all tiles of the set
  double mean_force_N = 0, max_force_N = 0, force_integral_Ns = 0;  // of its magnitude, over all ticks
  double max_force_step_N = 0;                                      // |f - f of the tick before|, the first from zero
  std::optional<std::uint64_t> missed_deadlines;                    // real time only

  // Beyond it.
  std::optional<LoopReport> loop;               // real time only
  ResidencyCounters streaming;                  // zero for a scene in memory
  std::string cell;                             // name; of a tour's first leg
  std::uint64_t visited = 0, capped_ticks = 0;  // segments tested in all; ticks that hit the solver's cap
  int back_offs = 0;                            // how often the person gave a try up
  // Routes begun, travelled to their end, jumps between them; ticks at which the hand had to wait for a jump: for the
  // next route to be planned (real time only) or its first tile to be read. Of one route: 1, 0 or 1, 0, 0.
  std::uint64_t legs = 0, legs_completed = 0, jumps = 0, jump_wait_ticks = 0;
  double stiffness_N_m = 0;
  bool passivity = false;             // the controller was on
  PassivityEnergy energy;             // see passivity.h
  std::vector<std::string> notes;     // for a person, one line each: stability, what real time was refused, rows lost
  std::vector<std::string> failures;  // tiles that could not be read (latency or real time): the set is damaged, exit 1
};

// A tour (route tour:SEED) travels one route after the other until its time is over. A leg ends when the proxy arrives,
// the person gives up, or ten times its nominal time and 20 s are over. The next leg's first tile is then asked for.
// When it is resident, the hand jumps: the place comes under the hand, the old force fades, and the new one grows over
// the ramp. Routes are read and planned between ticks in virtual time, in real time by a thread a few legs ahead.
//
// A run that was recorded can be replayed (device replay:FILE) in virtual time, whatever time it was recorded in: with
// the same set and options the rows are the same to the bit, frontiers and jumps included, since the recording says
// which tiles each tick met absent and when jumps were made. Two limits, both noted where they are met: a tick that met
// more than six absent tiles, and the *forces* commanded where the haptic loop was interrupted (the rows have those
// that were computed). A replay in real time is the same as long as neither run meets a frontier.
//
// Runs until the proxy arrives, the person gives up, time is over, a recording ends, or `stop` says so. Whatever ends
// it, the device's last command is zero force. Throws UsageError for options that make no sense, an unknown cell or
// route, a budget below the floor, a method not built; DeviceError from the device; IoError and ClosedPipe from its
// recording; CorruptTile, CorruptSet, IoError from the store; and passes on what on_tick throws.
RunSummary run(const TileStore& store, const RunOptions& options,
               const std::function<void(const TickRow&)>& on_tick = {});

// The cell that is travelled unless another is asked for. Throws UsageError where there is none. O(cells).
std::uint32_t defaultCell(const TileStore& store);

// The CSV of `navigate`: shortest decimals that read back to the same double. `cell_name` is written between quotation
// marks, each one in it doubled; an empty name is an empty field.
void writeCsvHeader(std::ostream& out);
void writeCsvRow(std::ostream& out, const TickRow& row, std::string_view cell_name = {});

}  // namespace filiform
