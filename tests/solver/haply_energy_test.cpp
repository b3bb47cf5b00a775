// The energy that a hand receives through the driver of the Haply service.
#include "tools/lab/reference/haply_sweep.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(HaplyEnergy, TheTransportGivesNoMoreThanTheBound) {
  const tools::HaplySweep sweep = tools::haplySweep(2);
  EXPECT_LE(sweep.beyond_J, 1e-9);
  EXPECT_EQ(sweep.cells.size(), 36U);
  EXPECT_GT(sweep.unanswered, 100U);
  const auto most = std::max_element(sweep.cells.begin(), sweep.cells.end(),
                                     [](const auto& a, const auto& b) { return a.given_J < b.given_J; });
  EXPECT_GT(most->given_J, 1e-3);
  for (const tools::HaplySweep::Cell& cell : sweep.cells)
    EXPECT_LE(cell.beyond_J, 1e-9) << cell.stiffness_N_m << " N/m, delay " << cell.delay << ", " << cell.period_s
                                   << " s";
}

TEST(HaplyEnergy, WithoutTheControllerTheBoundIsBroken) { EXPECT_GT(tools::haplySweep(1, false).beyond_J, 1e-3); }

}  // namespace
}  // namespace filiform
