#include "index/whole_number.h"

#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

template <typename T>
bool refused(const std::string& text) {
  try {
    wholeNumber<T>(nlohmann::json::parse(text));
  } catch (const std::out_of_range&) {
    return true;
  }
  return false;
}

TEST(WholeNumber, IsReadUpToBothEndsOfItsType) {
  for (const std::int64_t n : {std::numeric_limits<std::int64_t>::min(), std::int64_t{-1}, std::int64_t{0},
                               std::numeric_limits<std::int64_t>::max()})
    EXPECT_EQ(wholeNumber<std::int64_t>(nlohmann::json::parse(std::to_string(n))), n);
  EXPECT_EQ(wholeNumber<std::uint64_t>(nlohmann::json::parse("18446744073709551615")), UINT64_MAX);
  EXPECT_EQ(wholeNumber<int>(nlohmann::json::parse("-2147483648")), std::numeric_limits<int>::min());
  EXPECT_EQ(wholeNumber<std::uint32_t>(nlohmann::json::parse("4294967295")), UINT32_MAX);
}

TEST(WholeNumber, IsNothingElse) {
  for (const char* text : {"-5e20", "1e3", "1.0", "0.5", "1e300", "\"7\"", "true", "null", "[7]", "{}"}) {
    EXPECT_TRUE(refused<std::int64_t>(text)) << text;
    EXPECT_TRUE(refused<std::uint64_t>(text)) << text;
    EXPECT_TRUE(refused<int>(text)) << text;
  }
  EXPECT_TRUE(refused<std::uint64_t>("-1"));
  EXPECT_TRUE(refused<std::int64_t>("9223372036854775808"));
  EXPECT_TRUE(refused<std::uint64_t>("18446744073709551616"));
  EXPECT_TRUE(refused<std::uint32_t>("4294967303"));
  EXPECT_TRUE(refused<int>("4294967287")) << "-9 when cut to 32 bits";
  EXPECT_TRUE(refused<int>("-2147483649"));
}

}  // namespace
}  // namespace filiform
