#include "index/file/internal/digest.h"

#include <cstdint>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

std::string someText(std::size_t length) {
  std::string text;
  for (std::size_t i = 0; i < length; ++i) text += static_cast<char>(i * 131 + i / 251);
  return text;
}

TEST(RunningDigest, PiecesGiveTheChecksumOfTheWhole) {
  for (const std::size_t length : {0, 1, 16, 240, 241, 5000}) {
    const std::string text = someText(length);
    RunningDigest digest;
    for (std::size_t at = 0; at < length; at += 7) digest.add(std::string_view(text).substr(at, 7));
    EXPECT_EQ(digest.value(), checksum(text)) << length << " bytes";
    digest.reset();
    EXPECT_EQ(digest.value(), checksum(""));
  }
}

TEST(Checksum, IsXxh3) {
  EXPECT_EQ(checksum(""), 0x2D06800538D394C2u);
  const std::uint8_t byte = 'a';
  EXPECT_EQ(checksum({&byte, 1}), checksum("a"));
  EXPECT_NE(checksum("a", 1), checksum("a"));
}

}  // namespace
}  // namespace filiform::internal
