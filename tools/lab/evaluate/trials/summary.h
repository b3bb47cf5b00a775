// From trials to the figures of a table, and to comparisons route by route. Every trial counts, completed or not.
// Functions without state.
#pragma once

#include "tools/lab/evaluate/trials/campaign.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform::tools {

enum class Part : std::uint8_t { all, open, held_out };  // which of the cells

struct Spread {  // over trials, by nearest rank; NaN if there are no trials
  double median = 0, p10 = 0, p90 = 0;
};
Spread spreadOf(std::vector<double> values);
// "0.58 (0.51 to 0.72)": median, 10th and 90th percentile.
std::string shown(const Spread& spread);

struct TrialSummary {
  std::uint64_t trials = 0, completed = 0;
  double route_um = 0, route_m = 0;
  double force_integral_Ns = 0;                                // sum over the trials
  Spread integral_Ns, integral_per_um_Ns, trial_mean_force_N;  // over the trials
  double force_per_um_Ns = 0;                                  // sum of the integrals over the sum of the routes
  double mean_force_N = 0;                                     // over all ticks
  double step_p999_N = 0;                                      // median over the trials
  double step_max_N = 0, jump_max_m = 0;
  double jerks_per_m = 0;    // for each metre of route on the device
  double off = 0, skip = 0;  // arc off the route and arc leapt over, over the arc of the routes
  double visited_mean = 0;   // for each tick
  std::uint64_t visited_p99 = 0, visited_max = 0, capped_ticks = 0, ticks = 0;
  std::uint64_t stuck = 0, stuck_inherent = 0;  // events
  std::uint64_t inherent_failures = 0;          // trials, see TrialResult
  std::uint64_t timed = 0;                      // trials on which the solver was timed
  double solver_ns = 0;                         // mean over the timed trials, weighted by ticks; 0: none
  Spread trial_solver_ns;
  bool finite = true;
};

// Summarises the trials of one condition for which `keep` returns true (empty: all). `visited_p99` is over all trials.
TrialSummary summarise(const std::vector<CorpusCell>& cells, const Campaign& campaign, std::uint32_t condition,
                       Part part = Part::all, const std::function<bool(const TrialRow&)>& keep = {});

// The ratio of one figure under two conditions, route by route and seed by seed.
struct PairedRatio {
  std::uint64_t pairs = 0;
  double median = 0, p10 = 0, p90 = 0;
  std::uint64_t worse = 0;     // pairs with a ratio above 1
  std::vector<double> ratios;  // ascending
};
// Compares pairs of trials. `keep` selects by the first trial of a pair (empty: all). Pairs whose second figure is 0
// are left out. With `completed_only`, both trials must be completed.
PairedRatio compare(const std::vector<CorpusCell>& cells, const Campaign& campaign, std::uint32_t first,
                    std::uint32_t second, const std::function<double(const TrialResult&)>& figure, Part part,
                    bool completed_only, const std::function<bool(const TrialRow&)>& keep = {});

// Returns the position of the condition with this table, variant, method and zoom. Throws std::logic_error if there is
// none.
std::uint32_t findCondition(const std::vector<Condition>& conditions, const std::string& table,
                            const std::string& variant, const std::string& method, double zoom_um);

}  // namespace filiform::tools
