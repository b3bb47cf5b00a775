#include "index/ingest/tiling/internal/cell_leaves.h"

#include "tests/support/temp_folder.h"

#include <algorithm>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(CellLeaves, EachCellGetsItsLeavesAscending) {
  const std::uint64_t seed = 72;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  const test::TempFolder folder;
  const unsigned workers = 3;
  std::vector<CellRecord> records(50);
  for (CellRecord& record : records) record.segments = random() % 40;
  for (const bool ascending : {true, false}) {
    SCOPED_TRACE(ascending ? "ascending leaves" : "leaves in any order");
    std::map<std::uint32_t, std::vector<std::uint32_t>> expected;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  // leaf, cell
    for (std::uint32_t cell = 0; cell < records.size(); ++cell)
      for (std::uint64_t i = 0; i < records[cell].segments; ++i) {
        const auto leaf = static_cast<std::uint32_t>(random() % 1000);
        std::vector<std::uint32_t>& leaves = expected[cell];
        if (std::find(leaves.begin(), leaves.end(), leaf) != leaves.end()) continue;
        leaves.push_back(leaf);
        pairs.emplace_back(leaf, cell);
      }
    ascending ? std::sort(pairs.begin(), pairs.end()) : std::shuffle(pairs.begin(), pairs.end(), random);
    CellLeaves lists(records, workers, folder.path(), 4096, 1000);  // several groups
    for (const auto& [leaf, cell] : pairs) lists.add(leaf / 100 % workers, cell, leaf);
    lists.close();
    std::size_t groups = 0;
    for (std::uint32_t cell = 0; cell < records.size(); ++cell) {
      groups += lists.startsGroup(cell);
      std::vector<std::uint32_t>& leaves = expected[cell];
      std::sort(leaves.begin(), leaves.end());
      const auto found = lists.next(cell);
      EXPECT_EQ(std::vector<std::uint32_t>(found.begin(), found.end()), leaves) << "cell " << cell;
    }
    EXPECT_GT(groups, 3u);
  }
}

}  // namespace
}  // namespace filiform::internal
