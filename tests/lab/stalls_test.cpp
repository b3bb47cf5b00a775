#include "tools/lab/bench/device/stalls.h"

#include <cstdio>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

// Ten minutes with the stalls that a busy machine had (solver/RESULTS.md, "Regularity").
TEST(Stalls, ShortOnesBehindABridgeAreHardlyFelt) {
  for (const double stiffness_N_m : {50.0, 200.0, 800.0}) {
    StallRun steady{.seconds = 60, .stiffness_N_m = stiffness_N_m};
    runStalls(steady);
    EXPECT_EQ(steady.ramped_s, 0);
    for (const std::uint64_t seed : {1, 2, 3}) {
      StallRun run{.seed = seed, .stalls = 976, .stiffness_N_m = stiffness_N_m};
      runStalls(run);
      std::printf(
          "%4.0f N/m, seed %d: %.2f %% of the time on ramps, largest rise %.3f N in 0.25 ms, largest fall %.2f N "
          "(without stalls %.2f N), strongest %.2f N, %.1e J beyond the bound\n",
          stiffness_N_m, static_cast<int>(seed), 100 * run.ramped_s / run.seconds, run.largest_rise_N,
          run.largest_fall_N, steady.largest_fall_N, run.strongest_N, run.beyond_J);
      EXPECT_GT(run.ramped_s, 1);
      EXPECT_LE(run.ramped_s / run.seconds, 0.09);
      EXPECT_LE(run.largest_rise_N, 0.25 + 1e-9) << "1000 N/s";
      EXPECT_LE(run.beyond_J, 1e-9);
      EXPECT_GT(run.strongest_N, 1);
    }
  }
}

}  // namespace
}  // namespace filiform::tools
