#include "viewer/scene/draw_list.h"

#include "index/ingest/ingest.h"
#include "index/ingest/memory_tiles.h"
#include "index/set/tile_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"
#include "viewer/scene/camera.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

namespace filiform {
namespace {

class DrawLists : public ::testing::Test {
 protected:
  void SetUp() override {
    CellList stream(test::randomColumn(7, 6, 500, 400));
    store_ = buildTilesInMemory(stream, {.capacity = 64});
    for (TileId t = 0; t < store_->tile_count(); ++t) all_ += store_->entry(t).owned;
  }
  std::unique_ptr<TileStore> store_;
  std::uint64_t all_ = 0;
};

TEST_F(DrawLists, WithoutPlanesAndLimitEverythingIsDrawn) {
  const DrawList list = chooseTiles(*store_, nullptr, {}, Vector3d::Zero(), UINT64_MAX);
  EXPECT_EQ(list.segments, all_);
  EXPECT_EQ(list.left_out, 0u);
  EXPECT_EQ(list.error_px, 0);
}

// No tile with a point in the picture is culled. Tiles behind the eye are culled.
TEST_F(DrawLists, CullsTilesOutsideThePictureOnly) {
  const PictureSize size{400, 300};
  const EyeView view =
      viewOf(fitDepth(lookAt({0, 0, 120}, {60, 30, 0}), {-500, -500, -500}, {500, 500, 500}), size.aspect());
  const DrawList list = chooseTiles(*store_, nullptr, levelView(view, size), {60, 30, 0}, UINT64_MAX);
  std::set<TileId> drawn;
  for (const LevelPart& part : list.parts) drawn.insert(part.tile);
  ASSERT_LT(drawn.size(), store_->tile_count());
  std::size_t seen = 0;
  for (TileId t = 0; t < store_->tile_count(); ++t) {
    const auto tile = store_->load(t);
    for (std::uint32_t n = 0; n < tile->node_count(); ++n) {
      if (!tile->isHome(n)) continue;
      const ScreenPoint at = project(view, tile->position_W(n), size);
      if (at.depth_um < view.frustum.near_um || at.depth_um > view.frustum.far_um || at.x < 0 || at.y < 0 ||
          at.x > size.width || at.y > size.height)
        continue;
      EXPECT_TRUE(drawn.count(t)) << t;
      ++seen;
    }
  }
  EXPECT_GT(seen, 50u);
}

TEST_F(DrawLists, KeepsToTheBudgetNearestFirstAndCountsTheRest) {
  const Vector3d focus_W(50, 0, -20);
  for (const std::uint64_t most : {std::uint64_t{0}, all_ / 10, all_ / 2, all_ - 1}) {
    const DrawList list = chooseTiles(*store_, nullptr, {}, focus_W, most);
    EXPECT_LE(list.segments, most);
    EXPECT_EQ(list.segments + list.left_out, all_);
    EXPECT_GT(list.tiles_left_out, 0u);
    const std::uint64_t sum = [&] {
      std::uint64_t s = 0;
      for (const LevelPart& part : list.parts) s += store_->entry(part.tile).owned;
      return s;
    }();
    EXPECT_EQ(sum, list.segments);
    const auto distance = [&](TileId t) {
      const Vector3d lo = store_->grid().toWorld(store_->entry(t).content.lo);
      const Vector3d hi = store_->grid().toWorld(store_->entry(t).content.hi);
      return (focus_W - focus_W.cwiseMax(lo).cwiseMin(hi)).norm();
    };
    for (std::size_t i = 1; i < list.parts.size(); ++i)
      EXPECT_LE(distance(list.parts[i - 1].tile), distance(list.parts[i].tile));
    if (most > all_ / 5) {
      EXPECT_GT(list.segments, most / 2);
    }
  }
}

TEST_F(DrawLists, LevelsAreUsedWhereTheyAre) {
  test::TempFolder folder;
  CellList stream(test::randomColumn(7, 6, 2000, 200));
  IngestOptions options;
  options.capacity = 64;
  options.levels = true;
  ingest(stream, folder / "a.fil", options);
  const auto set = TileSet::open(folder / "a.fil");
  const auto levels = Levels::open(*set);
  ASSERT_NE(levels, nullptr);
  LevelView view;
  view.eye_W = Vector3d(0, 0, 2000);
  const DrawList few = chooseTiles(*set, levels.get(), view, Vector3d::Zero(), 1000);
  const DrawList many = chooseTiles(*set, levels.get(), view, Vector3d::Zero(), UINT64_MAX, 0);
  EXPECT_GT(few.error_px, 0);
  EXPECT_LT(few.segments, many.segments / 2);
  EXPECT_EQ(many.error_px, 0);
  EXPECT_EQ(many.left_out, 0u);
  EXPECT_TRUE(std::any_of(few.parts.begin(), few.parts.end(), [](const LevelPart& p) { return p.level; }));
}

}  // namespace
}  // namespace filiform
