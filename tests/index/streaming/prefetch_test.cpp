#include "index/streaming/internal/prefetch.h"

#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <limits>
#include <map>

#include <gtest/gtest.h>

namespace filiform {
namespace {

constexpr std::uint64_t kNoBudget = std::numeric_limits<std::uint64_t>::max();

// A neurite along x, one sample every 10 um, cut into many tiles.
class PrefetchTest : public testing::Test {
 protected:
  PrefetchTest() {
    Cell thread;
    for (std::uint32_t i = 0; i < 1000; ++i)
      test::addSample(thread, Vector3d(10.0 * i, 3, 3), i == 0 ? kNoParent : i - 1);
    CellList stream({thread});
    store_ = buildTilesInMemory(stream, {.capacity = 8});
    finder_ = std::make_unique<TileFinder>(*store_);
    loaded_ = std::make_unique<TileTable>(store_->tile_count());
  }

  TileId homeOf(std::uint32_t sample) const {
    return store_->leaves().home(store_->grid().snap({10.0 * sample, 3, 3}));
  }
  void load(TileId tile) {
    kept_.push_back(store_->load(tile));
    loaded_->add(*kept_.back());
  }
  ReaderFocus at(std::uint32_t sample, double speed_um_s, double radius_um) const {
    ReaderFocus focus;
    focus.active_tile = homeOf(sample);
    focus.active_node = {0, sample};
    focus.p_W = Vector3d(10.0 * sample, 3, 3);
    focus.v_W = Vector3d(speed_um_s, 0, 0);
    focus.radius_um = radius_um;
    return focus;
  }
  void claim(PrefetchPolicy policy, const ReaderFocus& focus, std::uint64_t budget = kNoBudget) {
    structure_.clear();
    workspace_.clear();
    const internal::KnownPages pages(*store_);
    const Prefetch prefetch(pages, *finder_, policy, 0.5);
    prefetch.claimAhead(focus, *loaded_, cell_tiles_, budget, structure_);
    prefetch.claimAround(focus, budget, workspace_);
  }
  static double costOf(const std::vector<TileClaim>& claims, TileId tile) {
    for (const TileClaim& c : claims)
      if (c.tile == tile) return c.cost;
    return std::numeric_limits<double>::infinity();
  }

  std::unique_ptr<TileStore> store_;
  std::unique_ptr<TileFinder> finder_;
  std::unique_ptr<TileTable> loaded_;
  std::vector<std::shared_ptr<const Tile>> kept_;
  std::vector<TileId> cell_tiles_;  // given to the prefetch as known
  std::vector<TileClaim> structure_, workspace_;
};

TEST_F(PrefetchTest, WorkspaceIsClaimedNearestFirst) {
  claim(PrefetchPolicy::distance, at(500, 0, 400));
  EXPECT_TRUE(structure_.empty());
  ASSERT_GT(workspace_.size(), 5u);
  EXPECT_EQ(workspace_[0].tile, homeOf(500));
  for (std::size_t i = 0; i < workspace_.size(); ++i) {
    EXPECT_LE(workspace_[i].cost, 400.0);
    EXPECT_GE(workspace_[i].cost, workspace_[i > 0 ? i - 1 : 0].cost);
  }
  for (const std::uint32_t sample : {461u, 500u, 539u}) EXPECT_LT(costOf(workspace_, homeOf(sample)), 1e9);
}

TEST_F(PrefetchTest, WorkspaceEndsWhereTheBudgetDoes) {
  const std::uint64_t budget = 3 * store_->entry(homeOf(500)).decoded_bytes;
  claim(PrefetchPolicy::distance, at(500, 0, 1e6), budget);
  std::uint64_t bytes = 0;
  for (const TileClaim& c : workspace_) bytes += store_->entry(c.tile).decoded_bytes;
  EXPECT_LE(bytes, budget);
  EXPECT_FALSE(workspace_.empty());
}

TEST_F(PrefetchTest, StructureClaimsTheAbsentTileThatTheThreadEnters) {
  const TileId here = homeOf(500);
  std::uint32_t ahead = 500;
  while (homeOf(ahead) == here) ++ahead;
  load(here);
  claim(PrefetchPolicy::structure, at(500, 100, 200));
  EXPECT_LT(costOf(structure_, homeOf(ahead)), 1e9);
  EXPECT_EQ(structure_[0].tile, here);
  std::uint32_t beyond = ahead;
  while (homeOf(beyond) == homeOf(ahead)) ++beyond;
  EXPECT_GT(costOf(structure_, homeOf(beyond)), 1e9) << "walked through a tile that is absent";
  load(homeOf(ahead));
  claim(PrefetchPolicy::structure, at(500, 1000, 200));
  EXPECT_LT(costOf(structure_, homeOf(beyond)), 1e9);
  EXPECT_LT(costOf(structure_, homeOf(ahead)), costOf(structure_, homeOf(beyond)));
}

TEST_F(PrefetchTest, StructureReachesAsFarAsTheSpeedCarries) {
  for (TileId tile = 0; tile < store_->tile_count(); ++tile) load(tile);
  claim(PrefetchPolicy::structure, at(500, 2000, 100));  // looks 0.5 s ahead: 1000 um
  EXPECT_LT(costOf(structure_, homeOf(590)), 0.51);
  EXPECT_GT(costOf(structure_, homeOf(650)), 1e9);
  claim(PrefetchPolicy::structure, at(500, 0, 100));  // at rest: the workspace
  EXPECT_LT(costOf(structure_, homeOf(508)), 1e9);
  EXPECT_GT(costOf(structure_, homeOf(590)), 1e9);
}

TEST_F(PrefetchTest, AShorterLookaheadReachesLessAtTheSamePace) {
  for (TileId tile = 0; tile < store_->tile_count(); ++tile) load(tile);
  const internal::KnownPages pages(*store_);
  Prefetch prefetch(pages, *finder_, PrefetchPolicy::structure, 0.5);
  for (const double speed_um_s : {0.0, 2000.0}) {
    std::vector<TileClaim> usual, shorter;
    prefetch.setLookahead(0.5);
    prefetch.claimAhead(at(500, speed_um_s, 800), *loaded_, {}, kNoBudget, usual);
    prefetch.setLookahead(0.1);
    prefetch.claimAhead(at(500, speed_um_s, 800), *loaded_, {}, kNoBudget, shorter);
    EXPECT_LT(shorter.size(), usual.size() / 3) << speed_um_s;
    EXPECT_GT(shorter.size(), 2u) << speed_um_s;
    for (const TileClaim& claim : shorter) EXPECT_NEAR(claim.cost, costOf(usual, claim.tile), 1e-9) << speed_um_s;
  }
}

TEST_F(PrefetchTest, AheadComesBeforeBehind) {
  for (TileId tile = 0; tile < store_->tile_count(); ++tile) load(tile);
  claim(PrefetchPolicy::structure, at(500, 1000, 100));
  EXPECT_LT(costOf(structure_, homeOf(530)), costOf(structure_, homeOf(470)));
  claim(PrefetchPolicy::structure, at(500, -1000, 100));
  EXPECT_GT(costOf(structure_, homeOf(530)), costOf(structure_, homeOf(470)));
}

TEST_F(PrefetchTest, TilesOfTheCellAreClaimedBeyondAnAbsentTile) {
  const TileId here = homeOf(500);
  load(here);
  cell_tiles_ = store_->loadCellDetail(0).tiles;
  claim(PrefetchPolicy::structure, at(500, 1000, 100));  // 500 um ahead
  for (const std::uint32_t sample : {510u, 530u, 545u})
    EXPECT_LT(costOf(structure_, homeOf(sample)), 0.5) << "sample " << sample;
  EXPECT_LT(costOf(structure_, homeOf(510)), costOf(structure_, homeOf(545)));
  EXPECT_LT(costOf(structure_, homeOf(530)), costOf(structure_, homeOf(470))) << "ahead first";
  EXPECT_GT(costOf(structure_, homeOf(600)), 1e9) << "beyond the look-ahead";

  // The proxy's tile is being loaded: claim the tiles around.
  loaded_ = std::make_unique<TileTable>(store_->tile_count());
  claim(PrefetchPolicy::structure, at(500, 1000, 100));
  EXPECT_EQ(structure_[0].tile, here);
  EXPECT_LT(costOf(structure_, homeOf(530)), 0.5);
}

TEST_F(PrefetchTest, BehindComesLaterButAsFar) {
  load(homeOf(500));
  cell_tiles_ = store_->loadCellDetail(0).tiles;
  claim(PrefetchPolicy::structure, at(500, 1000, 100));
  EXPECT_LT(costOf(structure_, homeOf(455)), 1e9) << "a turn changes the order, not the reach";
  EXPECT_GT(costOf(structure_, homeOf(455)), 0.5);
  EXPECT_GT(costOf(structure_, homeOf(400)), 1e9) << "beyond the look-ahead";
}

TEST_F(PrefetchTest, TheFartherTheHandTheFartherTheReach) {
  ReaderFocus focus = at(500, 0, 100);
  const Vector3d way_W = Vector3d::UnitX();
  const auto reaches = [&](std::uint32_t sample) {
    claim(PrefetchPolicy::structure, focus);
    return costOf(structure_, homeOf(sample)) < 1e9;
  };
  for (const bool in_memory : {false, true}) {
    if (in_memory)
      for (TileId tile = 0; tile < store_->tile_count(); ++tile) load(tile);
    else
      load(homeOf(500)), cell_tiles_ = store_->loadCellDetail(0).tiles;
    focus.pull_W.setZero();
    EXPECT_TRUE(reaches(508));
    EXPECT_FALSE(reaches(516));
    focus.pull_W = 8 * way_W;
    EXPECT_TRUE(reaches(516));
    focus.pull_W = 1e4 * way_W;
    EXPECT_TRUE(reaches(526));
    EXPECT_FALSE(reaches(536)) << "three times the reach, in " << (in_memory ? "memory" : "the list of tiles");
    for (const double wrong : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
      focus.pull_W = wrong * way_W;
      EXPECT_FALSE(reaches(516));
    }
    loaded_ = std::make_unique<TileTable>(store_->tile_count());
    kept_.clear();
  }
}

TEST_F(PrefetchTest, ThePullSaysWhatComesFirst) {
  load(homeOf(500));
  cell_tiles_ = store_->loadCellDetail(0).tiles;
  ReaderFocus focus = at(500, 0, 100);  // the proxy stands at the end of what is in memory
  focus.radius_um = 1000;
  for (const double way : {1.0, -1.0}) {
    focus.pull_W = Vector3d(way * 8, 0, 0);
    claim(PrefetchPolicy::structure, focus);
    const double ahead = costOf(structure_, homeOf(way > 0 ? 540 : 460));
    const double behind = costOf(structure_, homeOf(way > 0 ? 460 : 540));
    EXPECT_LT(1.5 * ahead, behind) << "pull to " << way;
  }
}

TEST_F(PrefetchTest, AheadEndsWhereTheBudgetDoes) {
  for (TileId tile = 0; tile < store_->tile_count(); ++tile) load(tile);
  cell_tiles_ = store_->loadCellDetail(0).tiles;
  const std::uint64_t budget = 5 * store_->entry(homeOf(500)).decoded_bytes;
  claim(PrefetchPolicy::structure, at(500, 1e5, 1e4), budget);
  std::uint64_t bytes = 0;
  for (const TileClaim& c : structure_) bytes += store_->entry(c.tile).decoded_bytes;
  EXPECT_LE(bytes, budget);
  EXPECT_GE(structure_.size(), 3u);
}

TEST_F(PrefetchTest, WayBackStaysBehindHoweverItTurns) {
  // A neurite that turns back: both arms lie side by side, and only one is ahead.
  Cell hairpin;
  for (std::uint32_t i = 0; i < 400; ++i)
    test::addSample(hairpin, i < 200 ? Vector3d(10.0 * i, 3, 3) : Vector3d(10.0 * (399 - i), 400, 3),
                    i == 0 ? kNoParent : i - 1);
  CellList stream({hairpin});
  store_ = buildTilesInMemory(stream, {.capacity = 8});
  finder_ = std::make_unique<TileFinder>(*store_);
  loaded_ = std::make_unique<TileTable>(store_->tile_count());
  for (TileId tile = 0; tile < store_->tile_count(); ++tile) load(tile);
  ReaderFocus focus = at(190, 2000, 100);  // 1000 um ahead: 100 um to the turn, 400 um across, and 500 um back
  focus.active_tile = store_->leaves().home(store_->grid().snap({1900, 3, 3}));
  claim(PrefetchPolicy::structure, focus);
  const TileId after_turn = store_->leaves().home(store_->grid().snap({1700, 400, 3}));
  const TileId behind = store_->leaves().home(store_->grid().snap({1200, 3, 3}));
  EXPECT_LT(costOf(structure_, after_turn), 0.45) << "weighed as going back";
  EXPECT_GT(costOf(structure_, behind), costOf(structure_, after_turn));
}

TEST_F(PrefetchTest, AHandOnAStructureClaimsAnEighthOfItsSurroundings) {
  const auto expectWithin = [this](double reach_um) {
    const auto hits = finder_->within(Vector3d(5000, 3, 3), reach_um * reach_um);
    EXPECT_EQ(workspace_.size(), hits.size());
    for (const auto& hit : hits) EXPECT_LE(costOf(workspace_, hit.tile), reach_um);
  };
  load(homeOf(500));
  ReaderFocus focus = at(500, 100, 1600);
  claim(PrefetchPolicy::structure, focus);
  expectWithin(200);
  claim(PrefetchPolicy::distance, focus);
  expectWithin(1600);
  focus.active_tile = kNoTile;  // the proxy moves freely
  claim(PrefetchPolicy::structure, focus);
  expectWithin(1600);
}

TEST_F(PrefetchTest, WhereReadsAreFastAHandOnAStructureClaimsLessAround) {
  load(homeOf(500));
  const internal::KnownPages pages(*store_);
  Prefetch prefetch(pages, *finder_, PrefetchPolicy::structure, 0.5);
  ReaderFocus focus = at(500, 100, 1600);
  prefetch.setLookahead(0.15);
  std::vector<TileClaim> claims;
  prefetch.claimAround(focus, kNoBudget, claims);
  EXPECT_EQ(claims.size(), finder_->within(focus.p_W, 60 * 60).size());
  claims.clear();
  prefetch.setLookahead(2);  // slow reads
  prefetch.claimAround(focus, kNoBudget, claims);
  EXPECT_EQ(claims.size(), finder_->within(focus.p_W, 200 * 200).size());
}

TEST_F(PrefetchTest, ViewClaimsItsSurroundingsOnly) {
  load(homeOf(500));
  ReaderFocus focus = at(500, 100, 100);
  focus.is_view = true;
  claim(PrefetchPolicy::structure, focus);
  EXPECT_TRUE(structure_.empty());
  EXPECT_FALSE(workspace_.empty());
}

TEST_F(PrefetchTest, WorkIsBounded) {
  CellList stream({test::hub(9000, 30)});
  store_ = buildTilesInMemory(stream, {.capacity = 100});
  finder_ = std::make_unique<TileFinder>(*store_);
  loaded_ = std::make_unique<TileTable>(store_->tile_count());
  for (TileId tile = 0; tile < store_->tile_count(); ++tile) load(tile);
  ReaderFocus focus;
  focus.p_W = Vector3d(5, -7, 11);
  focus.active_tile = store_->leaves().home(store_->grid().snap(focus.p_W));
  focus.active_node = {0, 0};
  focus.radius_um = 1e9;
  claim(PrefetchPolicy::structure, focus);
  EXPECT_FALSE(structure_.empty());
  EXPECT_LE(structure_.size(), Prefetch::kMaxWalkedSegments);
}

TEST_F(PrefetchTest, WhatIsNotFiniteClaimsNothing) {
  load(homeOf(500));
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  for (const double bad : {kNaN, kInf}) {
    ReaderFocus focus = at(500, 0, 100);
    focus.p_W.y() = bad;
    claim(PrefetchPolicy::structure, focus);
    EXPECT_TRUE(structure_.empty() && workspace_.empty());
    focus = at(500, 0, bad);
    claim(PrefetchPolicy::structure, focus);
    EXPECT_TRUE(structure_.empty() && workspace_.empty());
    focus = at(500, bad, 100);
    claim(PrefetchPolicy::structure, focus);  // an invalid velocity counts as rest
    EXPECT_FALSE(structure_.empty());
    for (const TileClaim& c : structure_) EXPECT_TRUE(std::isfinite(c.cost));
  }
}

TEST_F(PrefetchTest, UnknownPlacesClaimNothingAlongTheStructure) {
  claim(PrefetchPolicy::structure, at(500, 10, 100));  // active tile absent
  EXPECT_TRUE(structure_.empty());
  EXPECT_FALSE(workspace_.empty());
  load(homeOf(500));
  ReaderFocus focus = at(500, 10, 100);
  focus.active_node = {7, 7};
  claim(PrefetchPolicy::structure, focus);
  EXPECT_TRUE(structure_.empty());
  claim(PrefetchPolicy::none, at(500, 10, 100));
  EXPECT_TRUE(structure_.empty() && workspace_.empty());
}

}  // namespace
}  // namespace filiform
