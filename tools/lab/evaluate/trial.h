// One trial: a simulated person with a simulated hand travels one route of one cell with one method, in virtual time
// and with every tile resident. The same setup gives the same figures on every machine, but for the time that a tick
// takes. Thread rule: functions without state; a TrialCell belongs to one thread.
#pragma once

#include "device/simulated/simulated_hand.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/travel/route.h"
#include "solver/travel/simulated_person.h"
#include "solver/workspace/navigation.h"
#include "tools/lab/evaluate/trial_cell.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

// The methods, as `navigate --method` names them, and "nearest", the oracle (nearest_oracle.h).
const std::vector<std::string>& trialMethods();

struct TrialSetup {
  std::string method = "climb";
  std::string hand = "medium";
  double stiffness_N_m = 200;
  double zoom_um = 300;  // world across 0.12 m of device
  double rate_Hz = 1000;
  int delay_samples = 0;
  PersonParameters person;
  std::uint32_t max_visited = 0;  // segments a tick; 0: the solver's default. The oracle knows no bound
  AnchorUse anchor_use = AnchorUse::by_method;
  bool round_probe = false;   // the solver is given the probe in single precision
  CellTreatment treatment;    // of the cell that the trial is run on
  std::uint64_t seed = 1;     // of the tremor
  bool measure_time = false;  // costs a second run of the solver
};

inline constexpr double kJerk_N = 0.25;  // a force step that is felt as a jerk

// How often so many segments were tested in a tick; the last entry holds all beyond.
using VisitCounts = std::array<std::uint32_t, 1026>;

struct TrialResult {
  bool completed = false;                            // within arrive_m of the end of the route
  bool out_of_time = false;                          // else: the person gave up
  double route_um = 0, route_m = 0, reached_um = 0;  // route_m: on the device, at this zoom
  std::uint64_t ticks = 0;
  double force_integral_Ns = 0, mean_force_N = 0, max_force_N = 0;
  double step_p999_N = 0, step_max_N = 0;  // |f - f of the tick before|, the first from zero
  std::uint64_t jerks = 0;                 // ticks with a step above kJerk_N
  double jump_max_m = 0;                   // largest move in a tick of the point that the spring pulls to
  double off_um = 0, skip_um = 0;          // see TravelMeter
  std::uint64_t visited = 0, visited_p99 = 0, visited_max = 0, capped_ticks = 0;
  // The person backs off, or gives up: the hand has pulled as hard as it will.
  std::uint64_t stuck = 0, stuck_inherent = 0;  // see inherentlyStuck
  // Of them, those since the last progress, where the run was not completed.
  std::uint64_t last_stuck = 0, last_inherent = 0;
  double last_climb_m = 0;  // least climb (m of the device) at the last of them that was not inherent; 0: none
  bool finite = true;       // no force was NaN or infinite
  double solver_ns = 0;     // a tick of the solver alone, CPU time, caches warm; 0 unless measured

  bool inherentFailure() const { return !completed && last_stuck > 0 && last_inherent == last_stuck; }
};

struct TrialTrace {
  std::vector<float> force_N;  // of every tick
};

// `visits` and `trace` are filled where they are not null (visits is added to). Throws UsageError for a setup that
// makes no sense, and std::logic_error if the timed repetition of the solver ends elsewhere. Requires a route of that
// cell.
TrialResult runTrial(TrialCell& cell, const Route& route, const TrialSetup& setup, VisitCounts* visits = nullptr,
                     TrialTrace* trace = nullptr);

// What a trial is made of: its solver, its hand (closed), and what its navigation starts with.
std::unique_ptr<ProxySolver> makeTrialSolver(TrialCell& cell, const TrialSetup& setup);
SimulatedHandOptions trialHandOptions(const TrialSetup& setup);
NavigationOptions trialNavigationOptions(const TrialSetup& setup);

// The proxy jumps to t of the segment of that child. Throws UsageError if the cell has no such place.
void startTrial(Navigation& navigation, TrialCell& cell, std::uint32_t child, double t);

}  // namespace filiform::tools
