// Patterns for names: each kind of element, and a pattern that would take other matchers forever.
#include "index/cell/glob.h"

#include <fnmatch.h>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(Glob, MatchesAsFnmatchDoes) {
  std::mt19937_64 random(3);
  int matched = 0;
  for (int i = 0; i < 200000; ++i) {
    std::string pattern, name;
    for (std::size_t n = random() % 6; n > 0; --n) {
      static const char* const kElements[] = {"a", "b", "c", "*", "?", "[ab]", "[!a]", "[a-b]", "\\a"};
      pattern += kElements[random() % 9];
    }
    for (std::size_t n = random() % 6; n > 0; --n) name += static_cast<char>('a' + random() % 3);
    const bool expected = fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
    ASSERT_EQ(matchesGlob(pattern, name), expected) << pattern << ' ' << name;
    matched += expected ? 1 : 0;
  }
  EXPECT_GT(matched, 10000);
  EXPECT_TRUE(matchesGlob("[a", "[a"));
  EXPECT_TRUE(matchesGlob("[]]", "]"));
}

TEST(Glob, NamesMatchInAnyLetterCase) {
  EXPECT_TRUE(matchesName("TM3_*", "Tm3_194"));
  EXPECT_TRUE(matchesName("[a-t]m3", "TM3"));
  EXPECT_FALSE(matchesName("Tm4*", "Tm3_194"));
  EXPECT_FALSE(matchesGlob("tm3", "Tm3"));
}

TEST(Glob, ManyStarsTakeLittleTime) {
  std::string pattern;
  for (int i = 0; i < 1000; ++i) pattern += "a*";
  EXPECT_FALSE(matchesGlob(pattern + "b", std::string(5000, 'a')));
  EXPECT_TRUE(matchesGlob(pattern, std::string(5000, 'a')));
}

}  // namespace
}  // namespace filiform
