#include "solver/travel/run/internal/run_time.h"

#include <cmath>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(RunTime, CountsWholePeriodsExactly) {
  RunTime time(1000);
  for (int tick = 0; tick < 100000; ++tick) {
    time.setStep(time.period_s());
    time.pass();
  }
  EXPECT_EQ(time.periods(), 100000);
  EXPECT_EQ(time.now_s(), 100000 * 0.001);
}

TEST(RunTime, MeasuredStepsArePartsOfAPeriod) {
  RunTime time(500);
  time.setStep(0.004);
  EXPECT_DOUBLE_EQ(time.step_periods(), 2);
  time.pass();
  time.setStep(0.001);
  time.pass();
  EXPECT_DOUBLE_EQ(time.periods(), 2.5);
  EXPECT_DOUBLE_EQ(time.now_s(), 0.005);
}

TEST(RunTime, RoundsADurationUpToWholePeriods) {
  const RunTime time(1000);
  EXPECT_EQ(time.periodsOf(0.25), 250);
  EXPECT_EQ(time.periodsOf(0.2501), 251);
  EXPECT_EQ(time.periodsOf(0), 0);
  EXPECT_EQ(time.periodsOf(-1), 0);
  EXPECT_EQ(time.periodsOf(std::nan("")), 0);
  EXPECT_EQ(time.periodsOf(1e300), 1e15);
}

}  // namespace
}  // namespace filiform::internal
