#include "index/cell.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Names = std::vector<std::string>;

TEST(CellNames, AreBaseNamesWithoutEndings) {
  EXPECT_EQ(cellNames({"a/one.swc", "two.CNG.swc", "z.zip/x/Three.cng.SWC", "four", ".swc", "d/.swc"}),
            (Names{"one", "two", "Three", "four", ".swc", "d/.swc"}));
}

TEST(CellNames, GrowToTheShortestSuffixThatTellsApart) {
  EXPECT_EQ(cellNames({"p/a/x.swc", "q/a/x.swc", "q/b/x.swc", "y.swc"}), (Names{"p/a/x", "q/a/x", "b/x", "y"}));
}

TEST(CellNames, AWholePathMayBeTheSuffixOfAnother) {
  EXPECT_EQ(cellNames({"b/x.swc", "c/b/x.swc", "x.swc"}), (Names{"b/x", "c/b/x", "x"}));
}

TEST(CellNames, EndingsStayWhereOnlyTheyTellApart) {
  EXPECT_EQ(cellNames({"x.CNG.swc", "x.swc"}), (Names{"x.CNG.swc", "x.swc"}));
}

TEST(CellNames, EqualSourcesAreNumbered) {
  EXPECT_EQ(cellNames({"a/x.swc", "a/x.swc", "a/x.swc", "b/x.swc"}), (Names{"a/x", "a/x#2", "a/x#3", "b/x"}));
}

TEST(CellNames, AreNeverEqual) {
  EXPECT_EQ(cellNames({"x#2.swc", "x.swc", "x.swc"}), (Names{"x#2", "x", "x#3"}));
  EXPECT_EQ(cellNames({}), Names{});
}

}  // namespace
}  // namespace filiform
