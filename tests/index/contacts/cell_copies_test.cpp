#include "index/contacts/cell_copies.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(CellCopies, AreCellsWithTheSamePositionsAndLinks) {
  std::vector<Cell> cells;
  for (const std::uint64_t seed : {1, 2, 1, 3, 1, 2}) cells.push_back(test::randomNeuron(seed));
  cells[2].radii_um.assign(cells[2].samples(), 7);  // still the same neuron
  cells[3] = cells[1];                              // one sample elsewhere, within the same box
  const Vector3d away(0.25, 0, 0);
  std::uint32_t moved = 0;
  Vector3d lo = cells[3].positions_um[0], hi = lo;
  for (const Vector3d& p : cells[3].positions_um) lo = lo.cwiseMin(p), hi = hi.cwiseMax(p);
  while ((cells[3].positions_um[moved].array() < lo.array() + 1).any() ||
         (cells[3].positions_um[moved].array() > hi.array() - 1).any())
    ++moved;
  cells[3].positions_um[moved] += away;
  cells.emplace_back();
  cells.emplace_back();  // two cells without samples are no neuron twice
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].source = std::string(1, static_cast<char>('a' + i));
  const auto store = test::storeOf(cells, 50);
  const std::vector<CellCopy> copies = findCopies(*store, {0, 1, 2, 3, 4, 5, 6, 7}, 1 << 20, 2);
  ASSERT_EQ(copies.size(), 3u);
  EXPECT_EQ(copies[0].cell, 2u);
  EXPECT_EQ(copies[0].of, 0u);
  EXPECT_EQ(copies[1].cell, 4u);
  EXPECT_EQ(copies[1].of, 0u);
  EXPECT_EQ(copies[2].cell, 5u);
  EXPECT_EQ(copies[2].of, 1u);
  EXPECT_TRUE(findCopies(*store, {0, 1, 3}).empty());
}

}  // namespace
}  // namespace filiform
