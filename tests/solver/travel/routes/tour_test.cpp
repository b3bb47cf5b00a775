#include "solver/travel/routes/tour.h"

#include "index/errors.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <memory>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

TEST(Tour, IsTheSameForASeed) {
  const auto store = storeOf(test::randomColumn(3, 6, 200, 80), 32);
  Tour one(*store, 11), same(*store, 11), other(*store, 12);
  int differ = 0;
  std::set<std::uint32_t> cells;
  for (int leg = 0; leg < 40; ++leg) {
    const Route a = one.next(), b = same.next(), c = other.next();
    ASSERT_EQ(a.cell(), b.cell());
    ASSERT_EQ(a.points().front().rank, b.points().front().rank);
    ASSERT_EQ(a.points().back().rank, b.points().back().rank);
    differ += a.cell() != c.cell() || a.points().back().rank != c.points().back().rank;
    cells.insert(a.cell());
    EXPECT_GT(a.length_um(), 0);
  }
  EXPECT_GT(differ, 20);
  EXPECT_EQ(cells.size(), 6u);
}

TEST(Tour, StaysInTheCellThatItIsGiven) {
  const auto store = storeOf(test::randomColumn(3, 4, 150, 80), 32);
  Tour tour(*store, 1, 2);
  for (int leg = 0; leg < 10; ++leg) EXPECT_EQ(tour.next().cell(), 2u);
}

TEST(Tour, SkipsCellsWithoutARoute) {
  std::vector<Cell> cells;
  for (int i = 0; i < 30; ++i) cells.push_back(i % 3 == 0 ? test::isolatedNodes(i, 5, 10) : test::coincidentNodes(4));
  cells.push_back(test::randomNeuron(1, {.samples = 50}));
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].source = "c" + std::to_string(100 + i) + ".swc";
  const auto store = storeOf(std::move(cells), 32);
  Tour tour(*store, 5);
  for (int leg = 0; leg < 5; ++leg) EXPECT_EQ(tour.next().cell(), 30u);
}

TEST(Tour, ReadsOnlyTheCellsThatItVisits) {
  const auto store = storeOf(test::randomColumn(9, 12, 300, 2000), 64);
  test::CountingStore counting(*store);
  Tour tour(counting, 4);
  const Route route = tour.next();
  std::set<TileId> of_cell;
  for (const TileId tile : store->loadCellDetail(route.cell()).tiles) of_cell.insert(tile);
  for (const TileId tile : counting.loads()) EXPECT_TRUE(of_cell.contains(tile)) << tile;
  EXPECT_FALSE(counting.loads().empty());
  EXPECT_LT(counting.loads().size(), store->tile_count());
}

TEST(Tour, RefusesASetWithoutRoutes) {
  for (const auto& store :
       {storeOf({}, 32), storeOf({test::coincidentNodes(3)}, 32), storeOf({test::isolatedNodes(1, 4, 5)}, 32)}) {
    Tour tour(*store, 1);
    EXPECT_THROW(tour.next(), UsageError);
  }
  const auto store = storeOf({test::coincidentNodes(3), test::randomNeuron(1, {.samples = 50})}, 32);
  Tour tour(*store, 1, 0);
  EXPECT_THROW(tour.next(), UsageError);
}

}  // namespace
}  // namespace filiform
