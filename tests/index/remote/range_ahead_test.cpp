#include "index/remote/internal/range_ahead.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::Bytes;
using internal::RangeAhead;

constexpr std::uint64_t kFile = 10 << 20;

TEST(RangeAhead, ARunFetchesMoreAndMore) {
  RangeAhead ahead;
  EXPECT_EQ(ahead.plan("f", 0, 100, kFile), 100u);
  EXPECT_EQ(ahead.plan("f", 100, 50, kFile), 50u);
  EXPECT_EQ(ahead.plan("f", 150, 50, kFile), RangeAhead::kFirst);
  EXPECT_EQ(ahead.plan("f", 200, 50, kFile), 2 * RangeAhead::kFirst);
  std::uint64_t most = 0;
  for (std::uint64_t at = 250; at < 1000; at += 50) most = ahead.plan("f", at, 50, kFile);
  EXPECT_EQ(most, RangeAhead::kMost);
  EXPECT_EQ(ahead.plan("f", 1000, kFile / 2, kFile), kFile / 2) << "never less than asked for";
  EXPECT_EQ(ahead.plan("f", 1000 + kFile / 2, 10, kFile / 2 + 1500), 500u) << "the file ends";
}

TEST(RangeAhead, OtherReadsFetchWhatTheyAskFor) {
  RangeAhead ahead;
  for (std::uint64_t at = 0; at < 100'000; at += 1000) EXPECT_EQ(ahead.plan("f", at, 900, kFile), 900u) << "gaps";
  for (std::uint64_t at = 0; at < 1000; at += 100) {
    EXPECT_EQ(ahead.plan("g", 1000 - at, 100, kFile), 100u) << "backwards";
  }
  ahead.plan("a", 0, 10, kFile);
  ahead.plan("b", 0, 10, kFile);
  ahead.plan("a", 10, 10, kFile);
  EXPECT_EQ(ahead.plan("b", 10, 10, kFile), 10u) << "each file has its own run";
  EXPECT_EQ(ahead.plan("a", 20, 10, kFile), RangeAhead::kFirst);
  EXPECT_EQ(ahead.plan("h", 0, 10, 0), 10u) << "a file of unknown size";
}

TEST(RangeAhead, GivesWhatItKeeps) {
  RangeAhead ahead;
  Bytes bytes(3), piece{1, 2, 3, 4, 5, 6};
  EXPECT_FALSE(ahead.take("f", 100, bytes));
  ahead.keep("f", 100, piece);
  EXPECT_TRUE(ahead.take("f", 103, bytes));
  EXPECT_EQ(bytes, (Bytes{4, 5, 6}));
  EXPECT_FALSE(ahead.take("f", 99, bytes));
  EXPECT_FALSE(ahead.take("f", 104, bytes));
  EXPECT_FALSE(ahead.take("g", 100, bytes));
  EXPECT_FALSE(ahead.take("f", UINT64_MAX - 1, bytes));
  ahead.forget();
  EXPECT_FALSE(ahead.take("f", 100, bytes));
}

TEST(RangeAhead, ARunGoesOnAfterThePieceThatIsKept) {
  RangeAhead ahead;
  for (std::uint64_t at = 0; at < 300; at += 100) ahead.plan("f", at, 100, kFile);
  ahead.keep("f", 200, Bytes(1000));
  Bytes bytes(100);
  for (std::uint64_t at = 300; at < 1200; at += 100) EXPECT_TRUE(ahead.take("f", at, bytes));
  EXPECT_EQ(ahead.plan("f", 1200, 100, kFile), 2 * RangeAhead::kFirst);
}

}  // namespace
}  // namespace filiform
