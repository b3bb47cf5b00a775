// The energy that a hand is given by the whole path from tick to motors, while everything goes wrong: ticks that stall,
// a guard that sends zero, states that stand still, force that is withheld, jumps and changes of mode, devices that
// clamp and ramp. The passivity controller is on; what is measured is what its bound (solver/FORCES.md, bound 8)
// misses.
//
// All in virtual time, from the seed alone. Thread rule: functions without state.
#pragma once

#include <cstdint>

namespace filiform::tools {

struct EnergySweep {
  std::uint64_t runs = 0, ticks = 0, stalls = 0, stale = 0, withheld = 0, commands = 0;
  double beyond_J = 0;      // the most energy given beyond the bound, in any window of any run
  std::uint64_t worst = 0;  // the seed of that run
  double unseen_J = 0;      // the most in a run that no sample shows: the hand turned back before the next one
  double most_given_J = 0;  // the most given in a window, for comparison
};

// `runs` runs of `seconds` each, seeds from `first_seed` on. `feed_back` false: the law is not told what was really
// sent; the bound is then broken, which a test shows.
EnergySweep energySweep(std::uint64_t first_seed, std::uint64_t runs, double seconds, bool feed_back = true);

}  // namespace filiform::tools
