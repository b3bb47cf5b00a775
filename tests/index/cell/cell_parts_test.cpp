#include "index/cell/cell_parts.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

struct Sample {
  std::uint16_t type;
  double x;
  float radius;
  std::uint32_t parent = kNoParent;
};

Cell cellOf(const std::vector<Sample>& samples) {
  Cell cell;
  cell.source = "folder/two.CNG.swc";
  for (const Sample& sample : samples) {
    cell.sample_ids.push_back(static_cast<std::int64_t>(10 * cell.samples()));
    cell.positions_um.emplace_back(sample.x, 0, 0);
    cell.types.push_back(sample.type);
    cell.radii_um.push_back(sample.radius);
    cell.parents.push_back(sample.parent);
  }
  return cell;
}

// "name: ids with parents", part by part.
std::string namedParts(const Cell& whole) {
  std::string text;
  for (const Cell& cell : cellPartsOf(whole).cells) {
    text += (text.empty() ? "" : " | ") + cell.name + ":";
    for (std::uint32_t segment = 0; segment < cell.segmentRanks(); ++segment) {
      const auto [child, parent] = cell.ends(segment);
      text += " " + std::to_string(cell.sample_ids[child]) + "<" + std::to_string(cell.sample_ids[parent]);
    }
  }
  return text;
}

TEST(CellParts, SomataApartAreCells) {
  EXPECT_EQ(namedParts(cellOf({{1, 0, 5}, {1, 100, 5}, {3, 6, 1, 0}, {3, 106, 1, 1}, {3, 7, 1, 2}})),
            "two/1: 0<0 20<0 40<20 | two/2: 10<10 30<10");
}

TEST(CellParts, SomataThatTouchAreOneCell) {
  const std::vector<Sample> samples{{1, 0, 5}, {1, 9, 4}, {3, 6, 1, 0}, {3, 20, 1, 1}};
  EXPECT_EQ(namedParts(cellOf(samples)), "");
  std::vector<Sample> more = samples;
  more.insert(more.end(), {{1, 100, 5}, {2, 110, 1, 4}});
  EXPECT_EQ(namedParts(cellOf(more)), "two/1: 0<0 10<10 20<0 30<10 | two/2: 40<40 50<40")
      << "a chain of touching somata";
}

TEST(CellParts, TreesWithoutASomaAndSomataAloneAreLoose) {
  const Cell whole =
      cellOf({{3, 50, 1}, {1, 0, 5}, {3, 6, 1, 1}, {1, 100, 5}, {3, 106, 1, 3}, {1, 300, 5}, {3, 51, 1, 0}});
  EXPECT_EQ(namedParts(whole), "two/1: 10<10 20<10 | two/2: 30<30 40<30 | two/loose: 0<0 50<50 60<0");
  EXPECT_EQ(cellPartsOf(whole).loose_trees, 2u);
}

TEST(CellParts, OneSomaKeepsTheFileWhole) {
  EXPECT_EQ(namedParts(cellOf({{1, 0, 5}, {3, 6, 1, 0}, {3, 50, 1}, {3, 51, 1, 2}})), "");
  EXPECT_EQ(namedParts(cellOf({{1, 0, 5}, {3, 6, 1, 0}, {1, 100, 5}})), "") << "a soma alone is no second cell";
  EXPECT_EQ(namedParts(cellOf({{3, 0, 1}, {3, 5, 1, 0}, {3, 50, 1}})), "");
  EXPECT_EQ(namedParts(Cell{}), "");
}

TEST(CellParts, UnknownRadiiTouchNothingElse) {
  EXPECT_EQ(namedParts(cellOf({{1, 0, kUnknownRadius}, {3, 1, 1, 0}, {1, 2, -1}, {3, 3, 1, 2}})),
            "two/1: 0<0 10<0 | two/2: 20<20 30<20");
}

TEST(CellParts, TooManySomataKeepTheFileWhole) {
  std::vector<Sample> samples;
  for (std::uint32_t i = 0; i < kMostSamplesOfSomata / 2 + 1; ++i) {
    samples.push_back({1, 10.0 * i, 1});
    samples.push_back({1, 10.0 * i + 1, 1, 2 * i});
  }
  samples[1].type = samples[5].type = 3;
  EXPECT_EQ(cellPartsOf(cellOf(samples)).cells.size(), 3u);
  samples.push_back({1, -10, 1});
  EXPECT_EQ(cellPartsOf(cellOf(samples)).cells.size(), 0u);
}

TEST(CellParts, LoopsBlocksAndOddRadiiStayWithTheirSamples) {
  Cell whole = cellOf({{1, 0, 5}, {3, 6, 1, 0}, {3, 7, 1, 1}, {1, 100, 5}, {3, 106, 1, 3}, {3, 107, 1, 4}});
  whole.block_starts = {2, 5};
  whole.odd_radii = {{1, {}}, {4, {}}};
  const std::vector<Cell> forest = cellPartsOf(whole).cells;
  ASSERT_EQ(forest.size(), 2u);
  EXPECT_EQ(forest[0].block_starts, (std::vector<std::uint32_t>{2}));
  EXPECT_EQ(forest[1].block_starts, (std::vector<std::uint32_t>{2}));
  ASSERT_EQ(forest[1].odd_radii.size(), 1u);
  EXPECT_EQ(forest[1].odd_radii[0].rank, 1u);
  whole.block_starts = {};
  whole.odd_radii = {};
  connect(whole, {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}});
  ASSERT_TRUE(whole.isGraph());
  const std::vector<Cell> graph = cellPartsOf(whole).cells;
  ASSERT_EQ(graph.size(), 2u);
  EXPECT_TRUE(graph[0].isGraph());
  EXPECT_EQ(graph[0].links.size(), 3u);
  EXPECT_FALSE(graph[1].isGraph());
  EXPECT_EQ(graph[1].parents, (std::vector<std::uint32_t>{kNoParent, 0, 1}));
}

}  // namespace
}  // namespace filiform
