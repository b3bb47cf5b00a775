#include "index/file/internal/base64.h"

#include <random>
#include <string>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

ByteSpan bytesOf(const std::string& text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

TEST(Base64, WritesWhatTheStandardShows) {
  EXPECT_EQ(toBase64({}), "");
  EXPECT_EQ(toBase64(bytesOf("f")), "Zg==");
  EXPECT_EQ(toBase64(bytesOf("fo")), "Zm8=");
  EXPECT_EQ(toBase64(bytesOf("foo")), "Zm9v");
  EXPECT_EQ(toBase64(bytesOf("foobar")), "Zm9vYmFy");
}

TEST(Base64, BytesSurviveIt) {
  std::mt19937_64 random(3);
  for (std::size_t n = 0; n < 100; ++n) {
    Bytes bytes(n);
    for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
    EXPECT_EQ(fromBase64(toBase64(bytes)), bytes);
  }
}

TEST(Base64, RefusesOtherTexts) {
  for (const char* text : {"Z", "Zg", "Zg=", "Zh==", "Zg==Zg==", "Zm9v\n", "Zm 9", "====", "Zm9=", "Zm-_"})
    EXPECT_THROW(fromBase64(text), Damage) << text;
}

}  // namespace
}  // namespace filiform::internal
