// What stalls of filiform's loop do to the force behind a bridge, in virtual time: ForceLaw with the passivity
// controller and its local model, the rules of tools/bridges/bridge_force.h, and a hand that a person leads to and fro.
// Thread rule: a pure function.
#pragma once

#include <cstdint>

namespace filiform::tools {

struct StallRun {
  std::uint64_t seed = 1;
  int stalls = 0;  // at random times, each of 12 to 45 ms
  double seconds = 600, stiffness_N_m = 200;
  // Found, after 2 s:
  double ramped_s = 0;  // with a part of the force only, or none
  double strongest_N = 0;
  double largest_rise_N = 0;  // in a step of the bridge, 0.25 ms, beyond what the hand's own way adds
  double largest_fall_N = 0;  // in such a step: a fall is never delayed
  double beyond_J = 0;        // energy beyond the bound of solver/FORCES.md
};

void runStalls(StallRun& run);

}  // namespace filiform::tools
