// The energy that a hand receives through the driver of the Haply service, over stiffness, delay and period: a spring
// of ForceLaw with the passivity controller, against simulated hands that a person leads to and fro. Forces act as the
// service applies them, with its delays, stalls and lost answers. In virtual time; depends on nothing but its argument.
// Thread rule: functions without state.
#pragma once

#include <cstdint>
#include <vector>

namespace filiform::tools {

struct HaplySweep {
  struct Cell {
    double stiffness_N_m = 0;
    int delay = 0;  // messages until a force acts
    double period_s = 0;
    double given_J = 0;   // the most energy given in any window
    double beyond_J = 0;  // the most beyond the bound of that window
  };
  std::vector<Cell> cells;
  double beyond_J = 0;
  std::uint64_t ticks = 0, unanswered = 0;
};

// Runs each combination for `seconds` of virtual time. Without `controls`, the passivity controller only observes. The
// bound is then exceeded, as a test shows.
HaplySweep haplySweep(double seconds, bool controls = true);

}  // namespace filiform::tools
