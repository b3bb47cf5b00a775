#include "index/file/faulty_source.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

namespace filiform {
namespace {

class FaultySourceTest : public testing::Test {
 protected:
  FaultySourceTest() {
    test::writeBytes(folder_ / "a", std::string(1000, 'a'));
    test::writeBytes(folder_ / "b", std::string(1000, 'b'));
  }
  std::unique_ptr<FaultySource> make(FaultPlan plan) {
    waits_.clear();
    plan.wait = [this](double s) { waits_.push_back(s); };
    auto source = std::make_unique<FaultySource>(openFolder(folder_.path()), std::move(plan));
    source->arm();
    return source;
  }
  static bool reads(const FaultySource& source, const std::string& name, std::uint64_t offset) {
    std::vector<std::uint8_t> bytes(10);
    try {
      source.read(name, offset, bytes);
    } catch (const IoError&) {
      return false;
    }
    return bytes == std::vector<std::uint8_t>(10, static_cast<std::uint8_t>(name[0]));
  }

  test::TempFolder folder_;
  std::vector<double> waits_;
};

TEST_F(FaultySourceTest, LetsEverythingPassUntilArmed) {
  const auto source = make({.delay = FaultPlan::Delay::constant, .delay_s = 1, .fail_every = 1});
  source->disarm();
  for (std::uint64_t i = 0; i < 10; ++i) EXPECT_TRUE(reads(*source, "a", i));
  EXPECT_TRUE(waits_.empty());
  EXPECT_EQ(source->reads(), 0u);
  source->arm();
  EXPECT_FALSE(reads(*source, "a", 0));
  EXPECT_EQ(source->failures(), 1u);
  EXPECT_EQ(source->size("a"), 1000u);
}

TEST_F(FaultySourceTest, DelaysFollowTheirDistribution) {
  for (const auto delay : {FaultPlan::Delay::constant, FaultPlan::Delay::uniform, FaultPlan::Delay::exponential}) {
    const auto source = make({.delay = delay, .delay_s = 0.02, .most_s = 0.1});
    for (std::uint64_t i = 0; i < 900; ++i) ASSERT_TRUE(reads(*source, "a", i));
    ASSERT_EQ(waits_.size(), 900u);
    const double mean = std::accumulate(waits_.begin(), waits_.end(), 0.0) / 900;
    const auto [least, most] = std::minmax_element(waits_.begin(), waits_.end());
    EXPECT_NEAR(mean, 0.02, 0.002);
    EXPECT_GE(*least, 0.0);
    if (delay == FaultPlan::Delay::constant) {
      EXPECT_EQ(*least, *most);
    } else if (delay == FaultPlan::Delay::uniform) {
      EXPECT_LE(*most, 0.04);
    } else {
      EXPECT_LE(*most, 0.1);
      EXPECT_GT(*most, 0.06);
    }
  }
}

TEST_F(FaultySourceTest, EveryNthReadFails) {
  const auto source = make({.fail_every = 3});
  std::string outcome;
  for (std::uint64_t i = 0; i < 9; ++i) outcome += reads(*source, "a", i) ? '.' : 'x';
  EXPECT_EQ(outcome, "..x..x..x");
}

TEST_F(FaultySourceTest, WhatBefallsAReadDependsOnItsPlaceAndNotOnTheOrder) {
  const FaultPlan plan{.delay = FaultPlan::Delay::uniform, .delay_s = 0.01, .fail_probability = 0.3, .seed = 7};
  const auto run = [&](bool backwards) {
    const auto source = make(plan);
    std::vector<std::pair<bool, double>> outcome(200);
    for (std::uint64_t k = 0; k < 200; ++k) {
      const std::uint64_t i = backwards ? 199 - k : k;
      const bool good = reads(*source, i % 2 ? "a" : "b", i);
      outcome[i] = {good, waits_.back()};
    }
    return outcome;
  };
  const auto forwards = run(false);
  EXPECT_EQ(forwards, run(true));
  const auto failed = std::count_if(forwards.begin(), forwards.end(), [](const auto& o) { return !o.first; });
  EXPECT_GT(failed, 30);
  EXPECT_LT(failed, 90);
  // The next attempt at the same position draws again.
  const auto source = make(plan);
  int changed = 0;
  for (std::uint64_t i = 0; i < 200; ++i) changed += reads(*source, "a", i) != reads(*source, "a", i);
  EXPECT_GT(changed, 30);
}

TEST_F(FaultySourceTest, RangeFailsUntilHealed) {
  const auto source = make({.fail_probability = 1});
  source->disarm();
  source->failRange("a", 100, 200);
  EXPECT_TRUE(reads(*source, "a", 90));
  EXPECT_FALSE(reads(*source, "a", 91));
  EXPECT_FALSE(reads(*source, "a", 199));
  EXPECT_TRUE(reads(*source, "a", 200));
  EXPECT_TRUE(reads(*source, "b", 150));
  source->heal();
  source->arm();
  EXPECT_TRUE(reads(*source, "a", 150));
}

TEST_F(FaultySourceTest, ImpossiblePlansAreRefused) {
  const auto made = [&](FaultPlan plan) { FaultySource source(openFolder(folder_.path()), std::move(plan)); };
  EXPECT_THROW(made({.delay_s = -1}), UsageError);
  EXPECT_THROW(made({.delay_s = std::numeric_limits<double>::quiet_NaN()}), UsageError);
  EXPECT_THROW(made({.fail_probability = 1.5}), UsageError);
}

}  // namespace
}  // namespace filiform
