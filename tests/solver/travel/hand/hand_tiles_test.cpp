#include "solver/travel/hand/internal/hand_tiles.h"

#include "index/errors.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

std::unique_ptr<TileStore> twoCells() { return test::storeOf(test::randomColumn(7, 2, 600, 150), 64); }

std::uint64_t bytesOf(const TileStore& store, const std::vector<TileId>& tiles) {
  std::uint64_t bytes = 0;
  for (const TileId tile : tiles) bytes += store.entry(tile).decoded_bytes;
  return bytes;
}

// Some tiles other than the long-segment tile, which is always in memory.
std::vector<TileId> someTiles(const TileStore& store, std::size_t count) {
  std::vector<TileId> tiles;
  for (TileId tile = 0; tiles.size() < count; ++tile)
    if (tile != store.long_tile()) tiles.push_back(tile);
  return tiles;
}

TEST(HandTiles, HeldHasAllTilesAndReadsNoMore) {
  const auto store = twoCells();
  HandTiles source(*store, TileKind::held, {});
  EXPECT_EQ(source.table().size(), store->tile_count());
  EXPECT_EQ(source.reader(), nullptr);
  EXPECT_FALSE(source.mayEvict());
  EXPECT_FALSE(source.loadTogether(someTiles(*store, 1)));
  EXPECT_EQ(source.use().reads, 0u);
}

TEST(HandTiles, AReplayReadsEachTileOnce) {
  const auto store = twoCells();
  test::CountingStore counting(*store);
  HandTiles source(counting, TileKind::replay, {});
  const std::size_t first = counting.loads().size();
  EXPECT_FALSE(source.mayEvict());
  const std::vector<TileId> tiles = someTiles(*store, 3);
  EXPECT_TRUE(source.loadTogether(tiles));
  EXPECT_TRUE(source.loadTogether(tiles));
  EXPECT_EQ(counting.loads().size(), first + 3);
  EXPECT_EQ(source.use().reads, first + 3);
  for (const TileId tile : tiles) EXPECT_NE(source.table().find(tile), nullptr);
}

TEST(HandTiles, AReplayKeepsItsBudget) {
  const auto store = twoCells();
  const std::vector<TileId> tiles = someTiles(*store, 6);
  std::uint64_t most = 0;
  for (const TileId tile : tiles) most = std::max(most, bytesOf(*store, {tile}));
  ResidencyOptions options;
  options.budget_bytes = 2 * most + (store->long_tile() != kNoTile ? bytesOf(*store, {store->long_tile()}) : 0);
  HandTiles source(*store, TileKind::replay, options);
  EXPECT_TRUE(source.mayEvict());
  for (std::size_t i = 0; i + 1 < tiles.size(); ++i) {
    EXPECT_TRUE(source.loadTogether(std::vector<TileId>{tiles[i], tiles[i + 1]}));
    EXPECT_NE(source.table().find(tiles[i]), nullptr);
    EXPECT_NE(source.table().find(tiles[i + 1]), nullptr);
  }
  EXPECT_EQ(source.table().find(tiles[0]), nullptr);
  EXPECT_LE(source.use().peak_bytes, options.budget_bytes);
}

TEST(HandTiles, HiddenTilesAreAbsentUntilShown) {
  const auto store = twoCells();
  for (const TileKind kind : {TileKind::held, TileKind::replay}) {
    HandTiles source(*store, kind, {});
    const std::vector<TileId> tiles = someTiles(*store, 3);
    source.loadTogether(tiles);
    const std::vector<std::uint32_t> hidden{tiles[0], tiles[2], store->tile_count(), UINT32_MAX};
    source.hide(hidden);
    EXPECT_EQ(source.table().find(tiles[0]), nullptr);
    EXPECT_NE(source.table().find(tiles[1]), nullptr);
    EXPECT_TRUE(source.hides(tiles[2]));
    EXPECT_FALSE(source.hides(tiles[1]));
    source.loadTogether(tiles);
    EXPECT_EQ(source.table().find(tiles[0]), nullptr);
    source.show();
    for (const TileId tile : tiles) EXPECT_NE(source.table().find(tile), nullptr);
    EXPECT_FALSE(source.hides(tiles[0]));
  }
}

TEST(HandTiles, ADamagedTileIsNeverJustAbsent) {
  const auto store = twoCells();
  for (const TileKind kind : {TileKind::resident, TileKind::replay}) {
    test::CountingStore failing(*store);
    HandTiles source(failing, kind, {});
    const std::vector<TileId> tiles = someTiles(*store, 2);
    failing.failLoads(tiles[1]);
    EXPECT_THROW(source.loadTogether(tiles), CorruptTile);
  }
}

}  // namespace
}  // namespace filiform::internal
