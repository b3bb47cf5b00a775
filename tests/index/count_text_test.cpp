#include "index/count_text.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(CountText, GroupsDigitsAndCountsOneAsOne) {
  EXPECT_EQ(formatCount(0), "0");
  EXPECT_EQ(formatCount(1234567), "1 234 567");
  EXPECT_EQ(counted(0, "cell"), "0 cells");
  EXPECT_EQ(counted(1, "cell"), "1 cell");
  EXPECT_EQ(counted(1234, "cell"), "1 234 cells");
  EXPECT_EQ(counted(1, "morphology", "morphologies"), "1 morphology");
  EXPECT_EQ(counted(2, "morphology", "morphologies"), "2 morphologies");
}

}  // namespace
}  // namespace filiform
