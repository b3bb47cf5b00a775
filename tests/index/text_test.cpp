#include "index/text.h"

#include "index/errors.h"

#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <utility>

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

TEST(DecodeUtf8, ReadsWellFormedCharactersAlone) {
  const auto decoded = [](std::string_view text) {
    const Utf8Character character = decodeUtf8(text);
    return std::pair(character.length, static_cast<std::uint32_t>(character.code_point));
  };
  EXPECT_EQ(decoded("az"), std::pair(std::size_t{1}, 0x61u));
  EXPECT_EQ(decoded("\xC2\xB5m"), std::pair(std::size_t{2}, 0xB5u));
  EXPECT_EQ(decoded("\xE2\x82\xAC"), std::pair(std::size_t{3}, 0x20ACu));
  EXPECT_EQ(decoded("\xF0\x9F\xA7\xA0"), std::pair(std::size_t{4}, 0x1F9E0u));
  // A continuation alone, overlong forms, a surrogate, beyond Unicode, cut short.
  for (const char* text :
       {"\x80", "\xC1\x81", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xE2\x82", "\xFF"})
    EXPECT_EQ(decoded(text).first, 0u) << text;
}

TEST(InShort, KeepsTheBeginningAndTheEnd) {
  EXPECT_EQ(inShort("a b\n"), "a b\\n");
  EXPECT_EQ(inShort(std::string(200, 'x')), std::string(200, 'x'));
  const std::string path = "/" + std::string(60'000, 'x') + "/cell.swc";
  EXPECT_EQ(inShort(path).size(), 200u);
  EXPECT_TRUE(inShort(path).starts_with("/xxx"));
  EXPECT_TRUE(inShort(path).ends_with("x/cell.swc"));
  std::string accents;
  while (accents.size() < 60'000) accents += "\u00e9";
  EXPECT_TRUE(isUtf8(inShort(accents))) << "cut at whole characters";
  EXPECT_LE(inShort(accents).size(), 200u);
}

TEST(InShort, OfAMessageOnlyLongWordsAreCut) {
  const std::string message = "--name " + std::string(60'000, 'x') + ":  give  a name ";
  EXPECT_EQ(withShortWords(message), "--name " + inShort(std::string(60'000, 'x') + ":") + "  give  a name ");
  EXPECT_EQ(withShortWords(""), "");
  EXPECT_EQ(withShortWords(" a  b "), " a  b ");
}

TEST(InShort, NamesOfFilesAreShortInErrors) {
  const std::string word(60'000, 'x');
  EXPECT_LT(std::string(IoError(word + " " + word, "cannot open").what()).size(), 300u) << "a file name with a blank";
  EXPECT_LT(std::string(CorruptSet(word, 7, "no").what()).size(), 300u);
  EXPECT_EQ(CorruptSet(word, 7, "no").file(), word) << "the caller gets the whole name";
}

TEST(Base64, WritesWhatTheStandardShows) {
  EXPECT_EQ(toBase64(""), "");
  EXPECT_EQ(toBase64("f"), "Zg==");
  EXPECT_EQ(toBase64("fo"), "Zm8=");
  EXPECT_EQ(toBase64("foo"), "Zm9v");
  EXPECT_EQ(toBase64("foobar"), "Zm9vYmFy");
}

TEST(Base64, BytesSurviveIt) {
  std::mt19937_64 random(3);
  for (std::size_t n = 0; n < 100; ++n) {
    std::string bytes(n, '\0');
    for (char& b : bytes) b = static_cast<char>(random());
    EXPECT_EQ(fromBase64(toBase64(bytes)), bytes);
  }
}

TEST(Base64, RefusesOtherTexts) {
  for (const char* text : {"Z", "Zg", "Zg=", "Zh==", "Zg==Zg==", "Zm9v\n", "Zm 9", "====", "Zm9=", "Zm-_"})
    EXPECT_EQ(fromBase64(text), std::nullopt) << text;
}

}  // namespace
}  // namespace filiform
