#include "viewer/window/panels/internal/tile_census.h"

#include "index/streaming/residency.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

// A store with a directory of small pages, which records the pages that were read.
class PagedStore : public test::CountingStore {
 public:
  static constexpr TileId kPageTiles = 32;

  explicit PagedStore(const TileStore& store) : CountingStore(store), store_(store) {}
  const TileEntry& entry(TileId tile) const override {
    pages_read.insert(tile / kPageTiles);
    return store_.entry(tile);
  }
  TileId page_tiles() const override { return kPageTiles; }
  GridBox pageContent(std::uint32_t page) const override {
    GridBox box;
    for (TileId tile = page * kPageTiles; tile < std::min(tile_count(), (page + 1) * kPageTiles); ++tile)
      if (tile != long_tile()) box.extend(store_.entry(tile).content);
    return box;
  }
  std::vector<GridBox> pageBoxes(std::uint32_t page) const override { return {pageContent(page)}; }
  mutable std::set<std::uint32_t> pages_read;

 private:
  const TileStore& store_;
};

std::unique_ptr<TileStore> column() { return test::storeOf(test::randomColumn(5, 12, 500, 600), 8); }

double distance2(const NearTile& tile, const Vector3d& p_W) {
  return (tile.lo_W - p_W).cwiseMax(p_W - tile.hi_W).cwiseMax(0.0).squaredNorm();
}

TEST(TileCensus, ListsTheNearestTilesAndReadsTheirPagesOnly) {
  const auto store = column();
  const PagedStore paged(*store);
  const std::uint32_t pages = (store->tile_count() + PagedStore::kPageTiles - 1) / PagedStore::kPageTiles;
  ASSERT_GT(pages, 16u);
  const TileCensus census(paged);
  EXPECT_TRUE(paged.pages_read.empty());
  const Vector3d p_W = store->grid().toWorld(store->entry(store->tile_count() / 3).content.lo);
  const std::vector<NearTile> near = census.nearest(p_W, 20);
  ASSERT_EQ(near.size(), 20u);
  EXPECT_LT(paged.pages_read.size(), pages / 2);

  std::vector<double> all;
  for (const NearTile& tile : census.nearest(p_W)) all.push_back(distance2(tile, p_W));
  EXPECT_EQ(paged.pages_read.size(), pages);
  std::sort(all.begin(), all.end());
  for (std::size_t i = 0; i < near.size(); ++i)
    EXPECT_NEAR(std::sqrt(distance2(near[i], p_W)), std::sqrt(all[i]), 4 * store->grid().quantum_um()) << i;
}

TEST(TileCensus, CountsEveryTileByItsState) {
  const auto store = column();
  test::CountingStore failing(*store);
  for (TileId tile = 0; tile < store->tile_count(); tile += 3) failing.failLoads(tile);
  Residency residency(failing, {});
  TileReader& reader = residency.addReader("hand");
  ReaderFocus focus;
  focus.p_W = store->grid().toWorld(store->entry(5).content.lo);
  focus.radius_um = 60;
  reader.publishFocus(focus);
  for (std::uint64_t tick = 0; tick < 64; ++tick) residency.advance(tick, 4);

  TilePanel panel = countTiles(*store, &residency, {}, 1);
  const std::vector<NearTile> near = TileCensus(*store).nearest(focus.p_W, 100);
  showTiles(near, &residency, panel);
  std::uint64_t counts[7] = {};
  for (TileId tile = 0; tile < store->tile_count(); ++tile) ++counts[static_cast<int>(residency.state(tile))];
  EXPECT_TRUE(std::equal(counts, counts + 7, panel.counts));
  EXPECT_GT(counts[static_cast<int>(TileState::resident)], 0u);
  EXPECT_GT(counts[static_cast<int>(TileState::failed)], 0u);
  std::vector<TileState> expected, shown;
  for (const NearTile& tile : near) expected.push_back(residency.state(tile.tile));
  for (const TilePanel::Box& box : panel.boxes) shown.push_back(box.state);
  std::sort(expected.begin(), expected.end());
  std::sort(shown.begin(), shown.end());
  EXPECT_EQ(shown, expected);
}

TEST(TileCensus, OfASceneInMemoryEveryTileIsThere) {
  const auto store = column();
  TilePanel panel = countTiles(*store, nullptr, {}, 1);
  showTiles(TileCensus(*store).nearest({0, 0, 0}, 10), nullptr, panel);
  ASSERT_EQ(panel.boxes.size(), 10u);
  for (const TilePanel::Box& box : panel.boxes) EXPECT_EQ(box.state, TileState::resident);
}

}  // namespace
}  // namespace filiform::internal
