#include "solver/loop/loop_metrics.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(TimeHistogram, IsEmptyAtFirst) {
  const TimeHistogram histogram;
  EXPECT_EQ(histogram.count(), 0u);
  EXPECT_EQ(histogram.max_ns(), 0);
  EXPECT_EQ(histogram.percentile_ns(0.5), 0);
  EXPECT_EQ(histogram.mean_ns(), 0);
}

TEST(TimeHistogram, PercentilesAgreeWithSortingWithinABucket) {
  constexpr std::uint64_t kSeed = 3;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  TimeHistogram histogram;
  std::vector<std::int64_t> times;
  for (int i = 0; i < 20000; ++i) {
    times.push_back(
        static_cast<std::int64_t>(std::exp(std::uniform_real_distribution<double>(0, std::log(1e10))(random))));
    histogram.record(times.back());
  }
  std::sort(times.begin(), times.end());
  for (const double fraction : {0.0, 0.001, 0.25, 0.5, 0.9, 0.99, 0.9999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(fraction * 20000.0))) - 1;
    const double exact = static_cast<double>(times[rank]),
                 answer = static_cast<double>(histogram.percentile_ns(fraction));
    EXPECT_GE(answer, exact) << fraction;
    EXPECT_LE(answer, exact * (1 + 1.0 / 32) + 1) << fraction;
  }
  EXPECT_EQ(histogram.percentile_ns(1.0), times.back());
  EXPECT_EQ(histogram.max_ns(), times.back());
}

TEST(TimeHistogram, EveryBucketBoundaryIsCoveredOnce) {
  for (int bits = 0; bits < 45; ++bits) {
    for (const std::int64_t offset : {-1, 0, 1}) {
      const std::int64_t time = std::max<std::int64_t>(0, (std::int64_t{1} << bits) + offset);
      TimeHistogram histogram;
      histogram.record(time);
      EXPECT_EQ(histogram.percentile_ns(0.5), time);
      histogram.record(INT64_MAX);
      EXPECT_GE(histogram.percentile_ns(0.5), time);
      if (time < (std::int64_t{1} << 39)) {
        EXPECT_LE(histogram.percentile_ns(0.5), time + time / 32);
      }
    }
  }
}

TEST(TimeHistogram, TakesNegativeTimesAsZero) {
  TimeHistogram histogram;
  histogram.record(-5);
  EXPECT_EQ(histogram.percentile_ns(1), 0);
  EXPECT_EQ(histogram.mean_ns(), 0);
}

TEST(TimeHistogram, AddsAnotherAsIfItHadBeenRecordedHere) {
  TimeHistogram one, other, both;
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t time_ns = 17 * i * i;
    (i % 3 == 0 ? one : other).record(time_ns);
    both.record(time_ns);
  }
  one.add(other);
  EXPECT_EQ(one.count(), both.count());
  EXPECT_EQ(one.max_ns(), both.max_ns());
  EXPECT_DOUBLE_EQ(one.mean_ns(), both.mean_ns());
  for (const double fraction : {0.0, 0.1, 0.5, 0.99, 1.0})
    EXPECT_EQ(one.percentile_ns(fraction), both.percentile_ns(fraction));
}

TEST(LoopMetrics, CountsMissedDeadlinesAndKeepsTheLastTicks) {
  LoopMetrics metrics(4);
  for (int i = 0; i < 10; ++i) metrics.record({i * 1000, 10 + i, 20, 30, 1000, i % 3 == 0});
  EXPECT_EQ(metrics.ticks(), 10u);
  EXPECT_EQ(metrics.missed_deadlines(), 4u);
  EXPECT_EQ(metrics.period().count(), 9u);  // the first tick has none
  EXPECT_EQ(metrics.wake().count(), 10u);
  EXPECT_EQ(metrics.exchange().max_ns(), 20);
  EXPECT_EQ(metrics.compute().max_ns(), 30);
  const std::vector<LoopTick> last = metrics.lastTicks();
  ASSERT_EQ(last.size(), 4u);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(last[static_cast<std::size_t>(i)].start_ns, (6 + i) * 1000);
}

TEST(LoopMetrics, WritesTheLastTicksAsCsv) {
  LoopMetrics metrics(2);
  for (int i = 0; i < 3; ++i) metrics.record({i * 1000, 1, 2, 3, 1000, i == 2, i == 1, 0.5 * i});
  std::ostringstream out;
  metrics.writeCsv(out);
  EXPECT_EQ(out.str(),
            "tick,start_ns,wake_ns,exchange_ns,compute_ns,period_ns,missed,interrupted,force_N\n"
            "1,1000,1,2,3,1000,0,1,0.5\n2,2000,1,2,3,1000,1,0,1\n");
}

TEST(LoopMetrics, WithoutARingKeepsOnlyTheHistograms) {
  LoopMetrics metrics(0);
  metrics.record({});
  EXPECT_EQ(metrics.ticks(), 1u);
  EXPECT_TRUE(metrics.lastTicks().empty());
}

}  // namespace
}  // namespace filiform
