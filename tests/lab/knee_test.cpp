#include "tools/lab/bench/knee.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(Knee, IsWhereASteepFallBecomesSlow) {
  const std::vector<double> x{1, 2, 3, 4, 5, 6}, y{100, 60, 10, 8, 7, 6};
  EXPECT_EQ(kneeOf(x, y, false, false), 2u);
  // In other units the knee is at the same point.
  std::vector<double> scaled(y);
  for (double& v : scaled) v = 1e6 * v + 5;
  EXPECT_EQ(kneeOf(x, scaled, false, false), 2u);
}

TEST(Knee, LogarithmicAxesSeeOtherBends) {
  std::vector<double> x, y;
  for (int i = 0; i <= 20; ++i) {
    x.push_back(std::pow(10, 0.2 * i));
    y.push_back(1e4 / x.back() + 10);
  }
  const auto knee = kneeOf(x, y, true, true);
  ASSERT_TRUE(knee.has_value());
  EXPECT_NEAR(std::log10(x[*knee]), 2.55, 0.11);  // where the curve has the slope of the line, -0.74
  EXPECT_LT(x[*kneeOf(x, y, false, false)], 400);
}

TEST(Knee, StraightOrBulgingCurvesHaveNone) {
  EXPECT_FALSE(kneeOf({1, 2, 3, 4}, {4, 3, 2, 1}, false, false).has_value());
  EXPECT_FALSE(kneeOf({1, 2, 3, 4}, {10, 9, 8, 1}, false, false).has_value());
  EXPECT_FALSE(kneeOf({1, 2, 3, 4}, {5, 5, 5, 5}, false, false).has_value());
  EXPECT_FALSE(kneeOf({1, 2}, {5, 1}, false, false).has_value());
  EXPECT_FALSE(kneeOf({1, 10, 100, 1000}, {1000, 100, 10, 1}, true, true).has_value());
}

TEST(Knee, PassesOverWhatAnAxisCannotShow) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(kneeOf({0, 1, 10, 100, 1000}, {1, 1000, none, 10, 1}, true, true),
            kneeOf({1, 100, 1000}, {1000, 10, 1}, true, true));
  EXPECT_EQ(kneeOf({0, 1, 2, 3, 4}, {none, 100, 10, 8, 6}, false, false), 2u);
  EXPECT_THROW(kneeOf({1, 2, 3}, {1, 2}, false, false), std::invalid_argument);
}

TEST(LogSlope, IsTheExponentOfAPowerLaw) {
  std::vector<double> x, y;
  for (int i = 1; i < 9; ++i) {
    x.push_back(i * i);
    y.push_back(3 * std::pow(x.back(), 0.7));
  }
  EXPECT_NEAR(logSlope(x, y), 0.7, 1e-12);
  y[3] = 0;  // cannot be shown on a logarithmic axis, so it does not count
  EXPECT_NEAR(logSlope(x, y), 0.7, 1e-12);
  EXPECT_TRUE(std::isnan(logSlope({1}, {1})));
  EXPECT_TRUE(std::isnan(logSlope({2, 2}, {1, 3})));
}

}  // namespace
}  // namespace filiform::tools
