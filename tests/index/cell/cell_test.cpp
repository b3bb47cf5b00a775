#include "index/cell/cell.h"

#include <algorithm>
#include <numeric>
#include <random>

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

TEST(CellNames, AGivenNameGoesToTheFirstThatAsksForIt) {
  EXPECT_EQ(cellNames({"lib/a.swc", "lib/a.swc", "lib/a.swc", "lib/b.swc", "lib/b.swc"}, {"", "x", "a", "x", ""}),
            (Names{"a#2", "x", "a", "x#2", "b"}));
  EXPECT_EQ(cellNames({"a.swc", "b.swc", "c.swc"}, {"x", "x", "x#2"}), (Names{"x", "x#3", "x#2"}));
}

using Edges = std::vector<std::array<std::uint32_t, 2>>;

Cell withSamples(std::size_t n) {
  Cell cell;
  cell.sample_ids.resize(n);
  return cell;
}

TEST(Connect, MakesAForestWhereThereIsNoLoop) {
  Cell cell = withSamples(6);
  connect(cell, {{2, 1}, {1, 0}, {4, 3}});
  EXPECT_FALSE(cell.isGraph());
  EXPECT_EQ(cell.parents, (std::vector<std::uint32_t>{kNoParent, 0, 1, kNoParent, 3, kNoParent}));
  EXPECT_EQ(cell.segmentRanks(), 6u);
  EXPECT_EQ(cell.ends(2), (std::array<std::uint32_t, 2>{2, 1}));
  EXPECT_EQ(cell.ends(5), (std::array<std::uint32_t, 2>{5, 5}));
}

TEST(Connect, KeepsALoopAndADoubleLinkAndNamesSegmentsByTheirPlace) {
  Cell cell = withSamples(5);
  connect(cell, {{1, 0}, {1, 2}, {0, 2}, {3, 2}, {2, 3}});
  ASSERT_TRUE(cell.isGraph());
  EXPECT_TRUE(cell.parents.empty());
  EXPECT_EQ(cell.links, (Edges{{1, 0}, {2, 1}, {2, 0}, {3, 2}, {3, 2}, {4, 4}}));
}

TEST(Connect, OfAnEmptyCellIsEmpty) {
  Cell cell = withSamples(0);
  connect(cell, {});
  EXPECT_FALSE(cell.isGraph());
  EXPECT_EQ(cell.segmentRanks(), 0u);
}

TEST(Connect, LeavesOneRootAComponentAndEveryLinkOnce) {
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const std::uint32_t n = 1 + random() % 40, m = random() % 60;
    Edges edges;
    for (std::uint32_t e = 0; e < m; ++e) {
      const std::uint32_t a = random() % n, b = random() % n;
      if (a != b) edges.push_back({a, b});
    }
    std::vector<std::uint32_t> component(n);
    std::iota(component.begin(), component.end(), 0);
    for (std::uint32_t round = 0; round < n; ++round)
      for (const auto& [a, b] : edges) component[a] = component[b] = std::min(component[a], component[b]);
    Cell cell = withSamples(n);
    connect(cell, edges);

    std::vector<std::uint8_t> is_child(n, 0);
    std::vector<std::uint32_t> roots(n, 0);
    Edges found;
    for (std::uint32_t s = 0; s < cell.segmentRanks(); ++s) {
      const auto [child, parent] = cell.ends(s);
      if (child == parent) continue;
      is_child[child] = 1;
      found.push_back({std::min(child, parent), std::max(child, parent)});
    }
    for (std::uint32_t i = 0; i < n; ++i) roots[component[i]] += !is_child[i];
    for (std::uint32_t i = 0; i < n; ++i) EXPECT_EQ(roots[i], component[i] == i ? 1u : 0u);
    for (auto& [a, b] : edges)
      if (a > b) std::swap(a, b);
    if (!cell.isGraph()) {
      std::sort(found.begin(), found.end());
      std::sort(edges.begin(), edges.end());
    }
    EXPECT_EQ(found, edges);
  }
}

}  // namespace
}  // namespace filiform
