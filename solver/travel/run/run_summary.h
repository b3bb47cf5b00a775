// The result of a headless run: its outcome, and figures over all ticks. Plain values.
#pragma once

#include "index/streaming/residency.h"
#include "solver/force/passivity.h"
#include "solver/loop/loop_metrics.h"
#include "solver/proxy/proxy_solver.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

// How a run ended.
enum class RunOutcome {
  completed,    // the proxy came within arrive_m (PersonParameters) of the tip; or the time of a tour is over
  stuck,        // before the tip, the simulated person gave up, or the replayed recording ended
  time_over,    // the time for a route ended before the tip
  interrupted,  // by RunOptions::stop
  failed,       // by an exception; only in the summary that RunOptions::ending gets
};
const char* toString(RunOutcome outcome);  // the enumerator's name; used in JSON, text and pictures

struct LoopReport {  // of the haptic loop, see haptic_loop.h
  LoopMetrics metrics{0};
  std::uint64_t stale_ticks = 0, interruptions = 0, guard_exchanges = 0;
};

struct RunSummary {
  // In the order of `navigate --json`.
  RunOutcome outcome = RunOutcome::stuck;
  double route_um = 0;    // arc length of the route; for a tour, the sum over its legs
  double reached_um = 0;  // arc length that the proxy has reached, see RouteTracker; for a tour, the sum over its legs
  std::uint64_t ticks = 0;
  double sim_s = 0;            // the device's time over all ticks
  std::uint64_t segments = 0;  // of the whole set
  std::uint64_t tiles = 0;     // number of different tiles that the solver read
  std::uint64_t tiles_read = 0, evictions = 0;
  std::uint64_t stalls = 0, frontiers = 0;                          // ticks, see run.h
  std::uint64_t peak_bytes = 0;                                     // of decoded tiles in memory
  std::optional<std::uint64_t> budget_bytes;                        // none: unlimited
  std::uint64_t decoded_bytes = 0;                                  // of all tiles of the set
  double mean_force_N = 0, max_force_N = 0, force_integral_Ns = 0;  // of the magnitude, over all ticks
  double max_force_step_N = 0;                    // largest |f - f of the tick before|; before the first tick f is zero
  std::optional<std::uint64_t> missed_deadlines;  // real time only

  std::optional<LoopReport> loop;  // real time only
  ResidencyCounters streaming;     // zero for a scene in memory and for a replay
  std::string cell;                // name; for a tour, of its first leg
  std::string route;               // as RunOptions; for a replay, as recorded
  SolverMethod method = SolverMethod::climb;
  std::uint64_t visited = 0;       // total number of tested segments
  std::uint64_t capped_ticks = 0;  // ticks that reached the solver's cap
  int back_offs = 0;               // how often the simulated person gave up a try
  // Legs that were begun, and legs that were travelled to their end. A single route is one leg.
  std::uint64_t legs = 0, legs_completed = 0;
  // Jumps between legs; ticks in which the hand waited for a jump: for its tile, or in real time for its plan.
  std::uint64_t jumps = 0, jump_wait_ticks = 0;
  TimeHistogram jump_waits;  // of each jump: from its plan to the jump, that is for its tiles; in simulated time
  double stiffness_N_m = 0;
  bool passivity = false;             // the passivity controller was on
  PassivityEnergy energy;             // see passivity.h
  std::vector<std::string> notes;     // for the user, one line each: stability, refused real-time settings, lost rows
  std::vector<std::string> failures;  // one line for each tile that could not be read
  std::string error;                  // why the run failed; empty for all other outcomes
};

}  // namespace filiform
