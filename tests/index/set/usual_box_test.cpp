#include "index/set/usual_box.h"

#include "index/ingest/ingest.h"
#include "index/ingest/memory_tiles.h"
#include "index/set/tile_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::vector<Cell> movedBy(std::vector<Cell> cells, const Vector3d& way_um) {
  for (Cell& cell : cells)
    for (Vector3d& p_W : cell.positions_um) p_W += way_um;
  return cells;
}

UsualBox boxOfTiles(std::vector<Cell> cells) {
  CellList stream(std::move(cells));
  return buildTilesInMemory(stream, {.capacity = 200})->usualBox();
}

TEST(UsualBox, OneCellFarAwayDoesNotShrinkTheColumn) {
  const std::vector<Cell> column = test::randomColumn(7, 80, 300, 400);
  const UsualBox alone = boxOfTiles(column);
  EXPECT_EQ(alone.outside, 0u);
  std::vector<Cell> cells = column;
  for (Cell& cell : movedBy(test::randomColumn(8, 1, 300, 100), Vector3d(40000, 0, 0)))
    cells.push_back(std::move(cell));
  const UsualBox usual = boxOfTiles(cells);
  EXPECT_GE(usual.outside, 200u);
  EXPECT_LE(usual.outside, 320u);
  const double before = (alone.box.hi - alone.box.lo).cast<double>().maxCoeff(),
               after = (usual.box.hi - usual.box.lo).cast<double>().maxCoeff();
  EXPECT_NEAR(after, before, 0.1 * before);
}

TEST(UsualBox, TwoDistantGroupsAreBothFramed) {
  std::vector<Cell> cells = test::randomColumn(7, 20, 300, 200);
  for (Cell& cell : movedBy(test::randomColumn(8, 20, 300, 200), Vector3d(40000, 0, 0)))
    cells.push_back(std::move(cell));
  const UsualBox usual = boxOfTiles(cells);
  EXPECT_EQ(usual.outside, 0u);
  EXPECT_GT((usual.box.hi - usual.box.lo).x() / 512, 40000);
}

TEST(UsualBox, ASetStatesIt) {
  std::vector<Cell> cells = test::randomColumn(7, 80, 300, 400);
  for (Cell& cell : movedBy(test::randomColumn(8, 1, 300, 100), Vector3d(40000, 0, 0)))
    cells.push_back(std::move(cell));
  const UsualBox computed = boxOfTiles(cells);
  const test::TempFolder folder;
  CellList stream(std::move(cells));
  ingest(stream, folder / "a.fil", {.capacity = 200});
  const auto set = TileSet::open(folder / "a.fil");
  EXPECT_FALSE(set->leaves().knowsGroup(0));
  const UsualBox stated = set->usualBox();
  EXPECT_FALSE(set->leaves().knowsGroup(0)) << "nothing was read";
  EXPECT_GT(stated.outside, 0u);
  EXPECT_EQ(stated.outside, computed.outside);
  EXPECT_EQ(stated.box.lo, computed.box.lo);
  EXPECT_EQ(stated.box.hi, computed.box.hi);
  EXPECT_EQ(set->TileStore::usualBox().box.lo, stated.box.lo) << "from the directory";
}

TEST(UsualBox, OfOneTileIsItsContent) {
  const UsualBox usual = boxOfTiles(test::randomColumn(9, 1, 50, 50));
  EXPECT_EQ(usual.outside, 0u);
  EXPECT_FALSE(usual.box.empty());
}

}  // namespace
}  // namespace filiform
