// The options of a headless run (solver/travel/run/run.h). Thread rule: values.
#pragma once

#include "device/haptic_device.h"
#include "index/streaming/residency_options.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/travel/routes/route_choice.h"
#include "solver/travel/routes/simulated_person.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct NavigationSnapshot;
struct RunSummary;

struct RunOptions {
  std::optional<std::uint32_t> cell;  // none: defaultCell(); for a tour: all cells
  RouteChoice route{};                // the longest one of the cell
  std::optional<double> seconds;      // limit of simulated time; none: 10 times nominal + 20 s, for a tour 60 s
  SolverMethod method = SolverMethod::climb;
  std::optional<SolverParameters> solver;  // none: automaticParameters() of each cell
  std::string device = "sim:medium";       // as makeDevice() takes it; a simulated person leads a simulated hand
  std::optional<double> stiffness_N_m;     // none: 200, with the loose hand 50; hardware: defaultStiffness()
  // The passivity controller. None: on if the stiffness is not within the stability bound of hand and device, or if
  // their damping is unknown.
  std::optional<bool> passivity;
  double zoom_um = 300;  // world across 0.12 m of device
  double leap = 1;       // 0 to 1: see NavigationOptions
  double rate_Hz = 1000;
  int delay_samples = 1;    // of the simulated hand: 0, 1 or 2
  PersonParameters person;  // speed_m_s is the speed of the aim
  std::uint64_t seed = 1;   // of the person's tremor
  bool in_memory = false;   // the store has all tiles in memory (a small scene): no budget, no latency, no reads
  std::optional<std::uint64_t> budget_bytes;            // of decoded tiles; none: unlimited
  double latency_ms = 0;                                // virtual time only
  PrefetchPolicy prefetch = PrefetchPolicy::structure;  // not in virtual time at latency 0
  unsigned io_threads = 0;                              // real time only; see ResidencyOptions
  bool realtime = false;
  std::string record;  // write the exchanges with the device, and these options, to this file; empty: none
  // For a replay: the options, by the names of recorded_options.h, that count even where they have their defaults. All
  // others with their defaults are taken from the recording.
  std::vector<std::string> given{};
  // Makes `device` from its name and the period (s), not opened. None: makeDevice().
  std::function<std::unique_ptr<HapticDevice>(const std::string&, double)> make_device{};
  std::function<void(const NavigationSnapshot&)> on_snapshot{};  // virtual time only: after each tick
  // Called once, after the last tick: the recording is written and `on_tick` has all rows. A run in real time then
  // waits for its threads, which a hanging read can delay. The figures are those so far. Must not throw.
  std::function<void(const RunSummary&)> ending{};
  std::string fault_csv;  // real time only: file for the last ticks if the loop ends by a fault; empty: none
  const std::atomic<bool>* stop = nullptr;  // when it becomes true, the run ends as `interrupted` after this tick
  // If the run fails or is interrupted, an older file at `record` stays unchanged, and the new recording is kept in a
  // second file. Called with the name of that file.
  std::function<void(const std::string& path)> recording_kept{};
};

}  // namespace filiform
