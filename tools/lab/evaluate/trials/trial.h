// One trial: a simulated person with a simulated hand travels one route of one cell with one method, in virtual time
// and with every tile in memory. The same setup gives the same figures on every machine, except for solver_ns. Thread
// rule: functions without state; a TrialCell belongs to one thread.
#pragma once

#include "device/simulated/simulated_hand.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/travel/routes/route.h"
#include "solver/travel/routes/simulated_person.h"
#include "solver/workspace/navigation.h"
#include "tools/lab/evaluate/trials/trial_cell.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

// The method names of `navigate --method`, and "nearest", the oracle (nearest_oracle.h).
const std::vector<std::string>& trialMethods();

struct TrialSetup {
  std::string method = "climb";
  std::string hand = "medium";
  double stiffness_N_m = 200;
  double zoom_um = 300;  // tissue across 0.12 m of device
  double leap = 1;       // see NavigationOptions
  double rate_Hz = 1000;
  int delay_samples = 0;
  PersonParameters person;
  std::uint32_t max_visited = 0;  // segments a tick; 0: the solver's default. The oracle has no limit
  AnchorUse anchor_use = AnchorUse::by_method;
  bool round_probe = false;   // the solver gets the probe in single precision
  CellTreatment treatment;    // of the cell before it is tiled
  std::uint64_t seed = 1;     // of the tremor
  bool measure_time = false;  // runs the solver a second time
};

inline constexpr double kJerk_N = 0.25;  // a force step that a person feels as a jerk

// Number of ticks by segments tested; the last entry counts all larger numbers.
using VisitCounts = std::array<std::uint32_t, 1026>;

struct TrialResult {
  bool completed = false;                            // came within arrive_m of the end of the route
  bool out_of_time = false;                          // if not completed: time is over; false: the person gave up
  double route_um = 0, route_m = 0, reached_um = 0;  // route_m: on the device, at this zoom
  std::uint64_t ticks = 0;
  double force_integral_Ns = 0, mean_force_N = 0, max_force_N = 0;
  double step_p999_N = 0, step_max_N = 0;  // |f - f of the previous tick|; the first tick counts from zero
  std::uint64_t jerks = 0;                 // ticks with a step above kJerk_N
  double jump_max_m = 0;                   // largest move in one tick of the point that the spring pulls to
  double off_um = 0, skip_um = 0;          // see TravelMeter
  std::uint64_t visited = 0, visited_p99 = 0, visited_max = 0, capped_ticks = 0;
  // Events: the person backs off or gives up, after the hand has pulled at full strength.
  std::uint64_t stuck = 0, stuck_inherent = 0;  // see inherentlyStuck
  // The events since the last progress, if the run was not completed.
  std::uint64_t last_stuck = 0, last_inherent = 0;
  double last_climb_m = 0;  // least climb (m on the device) at the last event that was not inherent; 0: none
  bool finite = true;       // no force was NaN or infinite
  double solver_ns = 0;     // CPU time of a solver tick, caches warm; 0 if not measured

  bool inherentFailure() const { return !completed && last_stuck > 0 && last_inherent == last_stuck; }
};

struct TrialTrace {
  std::vector<float> force_N;  // for each tick
};

// Runs one trial. Fills `visits` (adds to it) and `trace` if they are not null. Throws UsageError for an invalid setup,
// and std::logic_error if the timed repetition of the solver ends elsewhere. Requires a route of this cell.
TrialResult runTrial(TrialCell& cell, const Route& route, const TrialSetup& setup, VisitCounts* visits = nullptr,
                     TrialTrace* trace = nullptr);

// The parts of a trial: its solver, its hand (closed), and the options of its navigation.
std::unique_ptr<ProxySolver> makeTrialSolver(TrialCell& cell, const TrialSetup& setup);
SimulatedHandOptions trialHandOptions(const TrialSetup& setup);
NavigationOptions trialNavigationOptions(const TrialSetup& setup);

// Moves the proxy to t of the segment with this child. Throws UsageError if the cell has no such place.
void startTrial(Navigation& navigation, TrialCell& cell, std::uint32_t child, double t);

}  // namespace filiform::tools
