#include "solver/travel/places/cell_walk.h"

#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "solver/travel/places/cell_search.h"
#include "solver/travel/places/place_finder.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

// 0 - 1 - 2 with a fork at 2: 3 - 4 upwards, 20 um more; 5 downwards, 5 um more. 6 is a tree of its own.
Cell forkedCell() {
  Cell cell;
  cell.source = "fork.swc";
  cell.sample_ids = {10, 11, 12, 13, 14, 15, 16};
  cell.positions_um = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}, {20, 10, 0}, {20, 20, 0}, {20, -5, 0}, {90, 0, 0}};
  cell.parents = {kNoParent, 0, 1, 2, 3, 2, kNoParent};
  cell.radii_um.assign(7, 1);
  cell.types = {1, 3, 3, 3, 3, 3, 3};
  return cell;
}

class Walks : public ::testing::Test {
 protected:
  void SetUp() override {
    CellList stream({forkedCell()});
    store_ = buildTilesInMemory(stream);
    walk_ = std::make_unique<CellWalk>(readCell(*store_, 0, false));
  }
  std::unique_ptr<TileStore> store_;
  std::unique_ptr<CellWalk> walk_;
};

TEST_F(Walks, StepsFromForkToForkAndBack) {
  const auto from = walk_->at(0);
  EXPECT_EQ(walk_->child(from), 1u);
  EXPECT_EQ(walk_->nextBranch(from), 2u);
  // The longer branch first, then the other, then the first again.
  EXPECT_EQ(walk_->nextBranch(walk_->at(2), 0), 4u);
  EXPECT_EQ(walk_->nextBranch(walk_->at(2), 1), 5u);
  EXPECT_EQ(walk_->nextBranch(walk_->at(2), 2), 4u);
  EXPECT_EQ(walk_->nextBranch(walk_->at(4)), std::nullopt);
  EXPECT_EQ(walk_->previousBranch(walk_->at(4)), 2u);
  EXPECT_EQ(walk_->previousBranch(walk_->at(2)), 0u);
  EXPECT_EQ(walk_->previousBranch(walk_->at(0)), std::nullopt);
  EXPECT_EQ(walk_->parent(walk_->at(5)), 2u);
  EXPECT_EQ(walk_->otherBranch(walk_->at(4)), 5u);
  EXPECT_EQ(walk_->otherBranch(walk_->at(5)), 3u);
  EXPECT_EQ(walk_->otherBranch(walk_->at(1)), std::nullopt);
  EXPECT_EQ(walk_->root(walk_->at(4)), 0u);
}

TEST_F(Walks, BetweenSamplesTheEndsAreNext) {
  const CellWalk::Spot spot{3, 0.25, 3, 2};
  EXPECT_EQ(walk_->child(spot), 3u);
  EXPECT_EQ(walk_->parent(spot), 2u);
  EXPECT_EQ(walk_->nextBranch(spot), 4u);
  EXPECT_EQ(walk_->otherBranch(spot), 5u);
  EXPECT_LT((walk_->position_W(spot) - Vector3d(20, 7.5, 0)).norm(), 1e-9);
}

TEST_F(Walks, PlacesAreFoundByNamePointAndSight) {
  const PlaceFinder finder(*store_);
  const ProxyPlace named = finder.find(parseCellQuery(" fork:14 "));
  ASSERT_TRUE(named.valid());
  EXPECT_EQ(named.p_W, Vector3d(20, 20, 0));
  EXPECT_EQ(finder.find(parseCellQuery("FOR")).p_W, Vector3d(0, 0, 0));  // its soma
  EXPECT_EQ(finder.find(parseCellQuery("12, 3 1")).p_W, Vector3d(12, 0, 0));
  EXPECT_THROW(finder.find(parseCellQuery("who")), UsageError);
  EXPECT_THROW(finder.find(parseCellQuery("fork:99")), UsageError);
  EXPECT_EQ(finder.find(parseCellQuery("fork:soma")).p_W, Vector3d(0, 0, 0));
  EXPECT_EQ(finder.find(parseCellQuery("FOR:19,21, 5")).p_W, Vector3d(20, 20, 0)) << "the sample nearest to a point";
  const ProxyPlace between = finder.find(parseCellQuery("fork:14+0.25"));
  ASSERT_TRUE(between.valid());
  EXPECT_EQ(between.t, 0.25);
  RayQuery ray;
  ray.origin_W = {5, 0.5, 100};
  ray.direction = {0, 0, -1};
  ray.radius_um = 1;
  const auto picked = finder.along(ray);
  ASSERT_TRUE(picked);
  EXPECT_EQ(picked->place.p_W, Vector3d(5, 0, 0));
  ray.origin_W.y() = 9;
  EXPECT_FALSE(finder.along(ray));
  for (std::uint32_t node = 0; node < walk_->samples(); ++node) {
    const ProxyPlace place = finder.atSample(*walk_, 0, node);
    ASSERT_TRUE(place.valid()) << node;
    EXPECT_EQ(place.p_W, walk_->graph().position_W(node));
    const auto spot = walk_->spotOf(place);
    ASSERT_TRUE(spot) << node;
    EXPECT_EQ(walk_->position_W(*spot), place.p_W);
  }
  const auto junction = finder.junction(finder.find(parseCellQuery("12 0 0")), Vector3d::Zero(), 100, 5);
  ASSERT_TRUE(junction);
  EXPECT_EQ(junction->p_W, Vector3d(20, 0, 0));
}

TEST(CellQueries, AreReadAsTyped) {
  EXPECT_EQ(parseCellQuery("1 -2.5 3e2").p_W, Vector3d(1, -2.5, 300));
  EXPECT_EQ(parseCellQuery("1,2,3").p_W, Vector3d(1, 2, 3));
  EXPECT_EQ(parseCellQuery("1 2").p_W, std::nullopt);
  EXPECT_EQ(parseCellQuery("1 2").name, "1 2");
  EXPECT_EQ(parseCellQuery("1 2 nan").p_W, std::nullopt);
  EXPECT_EQ(parseCellQuery("a:b:17").name, "a:b");
  EXPECT_EQ(parseCellQuery("a:b:17").place->sample, 17);
  EXPECT_FALSE(parseCellQuery("a:b").place);
  EXPECT_EQ(parseCellQuery("a:b").name, "a:b");
  EXPECT_EQ(parseCellQuery("").name, "");
}

TEST(CellQueries, AnEqualNameComesFirst) {
  std::vector<Cell> cells;
  for (const char* name : {"xcell_1", "Cell_10", "cell_1", "other"}) {
    cells.push_back(forkedCell());
    cells.back().source = std::string(name) + ".swc";
  }
  CellList stream(std::move(cells));
  const auto store = buildTilesInMemory(stream);
  const auto names = [&](const std::string& text, std::size_t most) {
    std::vector<std::string> found;
    for (const std::uint32_t cell : findCells(*store, text, most)) found.push_back(store->cell(cell).name);
    return found;
  };
  EXPECT_EQ(names("cell_1", 9), (std::vector<std::string>{"cell_1", "Cell_10", "xcell_1"}));
  EXPECT_EQ(names("cell_1", 1), (std::vector<std::string>{"cell_1"}));
  EXPECT_EQ(names("", 9).size(), 4u);
  EXPECT_TRUE(names("zebra", 9).empty());
  EXPECT_EQ(names("other.swc", 9), (std::vector<std::string>{"other"})) << "sources count if no name matches";
  const CellMatches matches = matchCells(*store, "CELL", false, 2);
  EXPECT_EQ(matches.count, 3u);
  EXPECT_EQ(matches.cells.size(), 2u);
}

}  // namespace
}  // namespace filiform
