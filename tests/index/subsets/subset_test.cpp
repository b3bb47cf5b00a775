#include "index/subsets/subset.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::vector<Cell> typedColumn(std::uint64_t seed) {
  std::vector<Cell> cells = test::randomColumn(seed, 12, 200, 120);
  std::mt19937_64 random(seed);
  for (Cell& cell : cells)
    for (std::uint16_t& type : cell.types) type = static_cast<std::uint16_t>(random() % 3);
  cells.push_back(test::isolatedNodes(seed, 20, 100));
  // Two loops, one of them through samples of both types.
  Cell loops;
  for (const Vector3d& p :
       {Vector3d(0, 0, 0), Vector3d(9, 0, 0), Vector3d(9, 9, 0), Vector3d(0, 9, 0), Vector3d(5, 5, 5)})
    test::addSample(loops, p, kNoParent, 1, p.z() > 0 ? 4 : 2);
  connect(loops, {{0, 1}, {1, 2}, {2, 0}, {2, 3}, {3, 4}, {4, 0}});
  cells.push_back(std::move(loops));
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].source = std::string(1, static_cast<char>('a' + i));
  return cells;
}

std::vector<std::uint32_t> allOf(const TileStore& store) {
  std::vector<std::uint32_t> cells(store.cell_count());
  std::iota(cells.begin(), cells.end(), 0U);
  return cells;
}

TEST(Subset, CellsInABoxHaveASegmentInIt) {
  constexpr std::uint64_t kSeed = 5;
  const std::vector<Cell> cells = typedColumn(kSeed);
  const auto store = test::storeOf(cells, 30);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> beside(-20, 5), size(0, 40);
  std::size_t found = 0;
  for (int i = 0; i < 40; ++i) {
    const std::vector<Vector3d>& samples = cells[random() % cells.size()].positions_um;
    const Vector3d lo = samples[random() % samples.size()] + Vector3d(beside(random), beside(random), beside(random));
    const GridBox box{store->grid().snap(lo),
                      store->grid().snap(lo + Vector3d(size(random), size(random), size(random)))};
    std::vector<std::uint32_t> some = allOf(*store), expected;
    some.erase(some.begin() + i % 5);
    for (const std::uint32_t cell : some) {
      const CellGraph graph = readCell(*store, cell, false);
      bool meets = false;
      for (std::uint32_t s = 0; s < graph.samples(); ++s) meets = meets || box.contains(graph.positions[s]);
      for (const auto& [parent, child] : parentLinks(graph))
        meets = meets || segmentMeetsBox(graph.positions[child], graph.positions[parent], box);
      if (meets) expected.push_back(cell);
    }
    EXPECT_EQ(cellsInBox(*store, some, box, {.threads = 2}), expected) << "seed " << kSeed << ", box " << i;
    found += expected.size();
  }
  EXPECT_GT(found, 20u);
}

TEST(Subset, CellsWithTypesHaveASampleOfThem) {
  const auto store = test::storeOf(typedColumn(6), 30);
  for (const std::vector<std::uint16_t>& types : std::vector<std::vector<std::uint16_t>>{{0}, {2, 4}, {4}, {3}, {77}}) {
    std::vector<std::uint32_t> expected;
    for (const std::uint32_t cell : allOf(*store)) {
      const std::vector<std::uint16_t> of_cell = readCell(*store, cell, true).types;
      if (std::find_first_of(of_cell.begin(), of_cell.end(), types.begin(), types.end()) != of_cell.end())
        expected.push_back(cell);
    }
    EXPECT_EQ(cellsWithTypes(*store, allOf(*store), types), expected);
  }
  // The only sample of its type is a root, which is the child of no segment.
  Cell cell;
  test::addSample(cell, Vector3d(0, 0, 0), kNoParent, 1, 1);
  test::addSample(cell, Vector3d(5, 0, 0), 0, 1, 3);
  EXPECT_EQ(cellsWithTypes(*test::storeOf({cell}), {0}, {1}), std::vector<std::uint32_t>{0});
}

TEST(Subset, KeptSamplesKeepTheirLinks) {
  const auto store = test::storeOf(typedColumn(7), 30);
  for (const std::uint32_t id : allOf(*store)) {
    SCOPED_TRACE(id);
    const CellGraph whole = readCell(*store, id, true);
    for (const std::vector<std::uint16_t>& types :
         std::vector<std::vector<std::uint16_t>>{{2}, {0, 1}, {0, 1, 2, 3, 4}, {77}}) {
      CellGraph part = whole;
      keepTypes(part, types);
      std::vector<std::uint32_t> kept;
      for (std::uint32_t i = 0; i < whole.samples(); ++i)
        if (std::find(types.begin(), types.end(), whole.types[i]) != types.end()) kept.push_back(i);
      ASSERT_EQ(part.samples(), kept.size());
      for (std::uint32_t i = 0; i < kept.size(); ++i) {
        EXPECT_EQ(part.positions[i], whole.positions[kept[i]]);
        EXPECT_EQ(part.sample_ids[i], whole.sample_ids[kept[i]]);
        EXPECT_EQ(part.types[i], whole.types[kept[i]]);
        EXPECT_TRUE(part.radii_um[i] == whole.radii_um[kept[i]] || std::isnan(whole.radii_um[kept[i]]));
      }
      using Link = std::pair<std::uint32_t, std::uint32_t>;
      std::vector<Link> expected, links;
      const auto add = [](std::vector<Link>& to, std::uint32_t a, std::uint32_t b) {
        to.push_back({std::min(a, b), std::max(a, b)});
      };
      const auto now = [&](std::uint32_t rank) {
        const auto at = std::lower_bound(kept.begin(), kept.end(), rank);
        return at != kept.end() && *at == rank ? static_cast<std::uint32_t>(at - kept.begin()) : kNoParent;
      };
      for (const auto& [parent, child] : parentLinks(whole))
        if (now(parent) != kNoParent && now(child) != kNoParent) add(expected, now(parent), now(child));
      for (const auto& [parent, child] : parentLinks(part)) add(links, parent, child);
      std::sort(expected.begin(), expected.end());
      std::sort(links.begin(), links.end());
      EXPECT_EQ(links, expected);
    }
  }
}

TEST(Subset, ABlockOfIdsBeginsAtItsFirstKeptSample) {
  Cell cell;
  for (int i = 0; i < 8; ++i) test::addSample(cell, Vector3d(i, 0, 0), kNoParent, 1, i == 2 || i >= 6 ? 2 : 3);
  cell.sample_ids = {1, 2, 1, 2, 1, 2, 1, 2};
  cell.block_starts = {2, 4, 6};
  const CellGraph whole = readCell(*test::storeOf({cell}), 0, true);
  const auto starts = [&](const std::vector<std::uint16_t>& types) {
    CellGraph part = whole;
    keepTypes(part, types);
    return part.block_starts;
  };
  EXPECT_EQ(starts({2, 3}), (std::vector<std::uint32_t>{2, 4, 6}));
  EXPECT_EQ(starts({2}), (std::vector<std::uint32_t>{1})) << "samples 2, 6 and 7";
  EXPECT_EQ(starts({3}), (std::vector<std::uint32_t>{2, 3})) << "samples 0, 1, 3, 4 and 5";
}

}  // namespace
}  // namespace filiform
