#include "index/cell/radius.h"

#include <charconv>
#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(Radius, IsOddIfTheTextOfItsFloatNamesAnotherNumber) {
  for (const double radius : {0.5, 0.1, 0.22725, 12.3456, 1e-3, 350 * 1e-3, 1e6})
    EXPECT_FALSE(isOddRadius(radius)) << radius;
  for (const double radius : {0.123456789, 0.6700000166893005, 1e-50, 16777217.0})
    EXPECT_TRUE(isOddRadius(radius)) << radius;
  for (const double radius : {0.0, -1.0, std::nan(""), HUGE_VAL, 1e60}) EXPECT_FALSE(isOddRadius(radius)) << radius;
}

TEST(Radius, StaysAboveZeroAsAFloat) {
  EXPECT_GT(storedRadius(1e-60), 0);
  EXPECT_EQ(storedRadius(0), 0);
  EXPECT_TRUE(std::isinf(storedRadius(1e60)));
}

TEST(Radius, FewDigitsAreNeverOdd) {
  std::mt19937 random(1);
  int few = 0, odd = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text = std::to_string(random() % 1000) + '.';
    for (unsigned digits = random() % 12; digits > 0; --digits) text += static_cast<char>('0' + random() % 10);
    for (unsigned zeros = random() % 4; zeros > 0; --zeros) text += '0';
    double radius = 0;
    std::from_chars(text.data(), text.data() + text.size(), radius);
    few += !mayBeOdd(text);
    odd += isOddRadius(radius);
    ASSERT_TRUE(mayBeOdd(text) || !isOddRadius(radius)) << text;
  }
  EXPECT_GT(few, 1000);
  EXPECT_GT(odd, 1000);
  EXPECT_TRUE(mayBeOdd("1e-50"));
  EXPECT_FALSE(mayBeOdd("0.000123456"));
  EXPECT_FALSE(mayBeOdd("1.2000000000"));
}

}  // namespace
}  // namespace filiform
