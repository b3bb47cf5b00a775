// How many requests a minute a person may send.
#include "tools/serve/people/quotas.h"

#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Quotas, AMinuteAtOnceThenEvenly) {
  Quotas quotas;
  const Quotas::Clock::time_point start{seconds(1000)};
  for (int i = 0; i < 6; ++i) EXPECT_EQ(quotas.take("ann", 6, start), 0u);
  EXPECT_EQ(quotas.take("ann", 6, start), 10u);
  EXPECT_EQ(quotas.take("ben", 6, start), 0u) << "another person has an own quota";
  EXPECT_EQ(quotas.take("ann", 6, start + milliseconds(4500)), 6u);
  EXPECT_EQ(quotas.take("ann", 6, start + seconds(11)), 0u) << "whoever waits as told is let in";
  EXPECT_EQ(quotas.take("ann", 6, start + milliseconds(12500)), 8u);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(quotas.take("ann", 6, start + seconds(1000)), 0u);
  EXPECT_NE(quotas.take("ann", 6, start + seconds(1000)), 0u) << "a long rest saves no more than a minute";
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(quotas.take("ann", 0, start), 0u);
}

TEST(Quotas, CountsThoseOfAMinute) {
  Quotas quotas;
  const Quotas::Clock::time_point start{seconds(1000)};
  EXPECT_EQ(quotas.count("a", start), 1u);
  EXPECT_EQ(quotas.count("a", start + seconds(59)), 2u);
  EXPECT_EQ(quotas.count("b", start + seconds(59)), 1u);
  EXPECT_EQ(quotas.count("a", start + seconds(61)), 1u);
}

TEST(Quotas, ForgetThoseOfEarlierMinutes) {
  Quotas quotas;
  const Quotas::Clock::time_point start{seconds(1000)};
  EXPECT_EQ(quotas.count("first", start), 1u);
  for (int i = 0; i < 5000; ++i) quotas.count("old " + std::to_string(i), start);
  EXPECT_EQ(quotas.count("first", start + seconds(30)), 2u);
  for (int i = 0; i < 10000; ++i) quotas.count("new " + std::to_string(i), start + seconds(30));
  EXPECT_EQ(quotas.count("first", start + seconds(31)), 1u) << "memory does not grow with the names";
}

}  // namespace
}  // namespace filiform::tools
