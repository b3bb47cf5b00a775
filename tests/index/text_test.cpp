#include "index/text.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::string_literals;

TEST(Escaped, LeavesPrintableTextAlone) {
  const std::string text = "caf\xC3\xA9 \\ path/\xE2\x82\xAC \xF0\x9F\xA7\xA0";
  EXPECT_EQ(escaped(text), text);
}

TEST(Escaped, WritesOutWhatSteersATerminal) {
  EXPECT_EQ(escaped("a\tb\nc\rd\x1B[2J\x7F\0e"s), "a\\tb\\nc\\rd\\x1b[2J\\x7f\\x00e");
  EXPECT_EQ(escaped("\xC2\x9B"
                    "31m \xE2\x80\xAE"),
            "\\u009b31m \\u202e");
}

TEST(Escaped, WritesOutBytesThatAreNotUtf8) {
  EXPECT_EQ(escaped("\xE9 \xC0\xAF \xED\xA0\x80 \xF5 \xE2\x82"), "\\xe9 \\xc0\\xaf \\xed\\xa0\\x80 \\xf5 \\xe2\\x82");
}

TEST(Escaped, WritesOutEveryMarkThatTurnsText) {
  EXPECT_EQ(escaped("\xD8\x9C\xE2\x80\x8E\xE2\x80\xAE\xE2\x81\xA6"), "\\u061c\\u200e\\u202e\\u2066");
}

TEST(Escaped, CutsAtAWholeCharacter) {
  EXPECT_EQ(escaped("abc", 3), "abc");
  EXPECT_EQ(escaped("abcd", 3), "abc...");
  EXPECT_EQ(escaped("ab\xC3\xA9", 3), "ab...");
}

TEST(EndsWithNoCase, ComparesAsciiLetters) {
  EXPECT_TRUE(endsWithNoCase("a.SwC", ".swc"));
  EXPECT_FALSE(endsWithNoCase("swc", ".swc"));
}

}  // namespace
}  // namespace filiform
