// The energy that the whole path from tick to motors gives to a hand under faults: stalled ticks, a guard that sends
// zero, repeated states, withheld force, jumps and changes of mode, devices that clamp and ramp. The passivity
// controller is on. The result is the energy beyond its bound (solver/FORCES.md, bound 8).
//
// Runs in virtual time and depends on the seed alone. Thread rule: functions without state.
#pragma once

#include <cstdint>

namespace filiform::tools {

struct EnergySweep {
  std::uint64_t runs = 0, ticks = 0, stalls = 0, stale = 0, withheld = 0, commands = 0;
  double beyond_J = 0;      // largest energy given beyond the bound, in any window of any run
  std::uint64_t worst = 0;  // the seed of that run
  double unseen_J = 0;  // largest energy in a run that no sample shows, because the hand turned back before the next
  double most_given_J = 0;  // largest energy given in a window, for comparison
};

// Performs `runs` runs of `seconds` each, with seeds from `first_seed`. If `feed_back` is false, the force law does not
// learn which force was really sent. The bound is then exceeded, as a test shows.
EnergySweep energySweep(std::uint64_t first_seed, std::uint64_t runs, double seconds, bool feed_back = true);

}  // namespace filiform::tools
