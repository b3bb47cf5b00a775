#include "index/query/internal/tile_cache.h"

#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::TileCache;

class SearchTiles : public ::testing::Test {
 protected:
  const std::unique_ptr<TileStore> tiles_ = test::storeOf(test::randomColumn(71, 8, 600, 300), 32);
  test::CountingStore store_{*tiles_};
  const internal::SegmentSieve all_{store_, {}};
  std::uint32_t reads_ = 0;

  std::uint64_t bytesOf(std::initializer_list<TileId> tiles) {
    TileCache all(store_, all_, TileEngineKind::packed, UINT64_MAX);
    for (const TileId tile : tiles) all.get(tile, reads_);
    return all.bytes();
  }
};

TEST_F(SearchTiles, TileIsReadOnce) {
  TileCache cache(store_, all_, TileEngineKind::packed, UINT64_MAX);
  EXPECT_FALSE(cache.find(3));
  EXPECT_EQ(cache.get(3, reads_)->tile->id(), 3u);
  EXPECT_EQ(cache.get(3, reads_)->tile->id(), 3u);
  EXPECT_TRUE(cache.find(3));
  EXPECT_EQ(reads_, 1u);
  EXPECT_EQ(store_.loads(3), 1u);
}

TEST_F(SearchTiles, LeasedTileOutlivesItsEviction) {
  TileCache cache(store_, all_, TileEngineKind::packed, 0);
  {
    const TileCache::Lease lease = cache.get(1, reads_);
    EXPECT_FALSE(cache.find(1));
    cache.get(2, reads_);
    EXPECT_GT(store_.heldBytes(), 0u);
    EXPECT_EQ(lease->tile->id(), 1u);
  }
  cache.get(3, reads_);
  cache.get(4, reads_);  // frees tiles that have no lease
  EXPECT_EQ(cache.bytes(), 0u);
  EXPECT_LE(store_.heldBytes(), store_.entry(4).decoded_bytes + store_.entry(3).decoded_bytes);
}

TEST_F(SearchTiles, UsedTileStaysAndTheOldestOthersGo) {
  const std::uint64_t room = bytesOf({1, 2, 3, 4});
  TileCache cache(store_, all_, TileEngineKind::packed, room);
  for (const TileId tile : {1, 2, 3, 4}) cache.get(tile, reads_);
  EXPECT_TRUE(cache.find(1));
  for (TileId tile = 5; cache.isHere(2); ++tile) cache.get(tile, reads_);
  EXPECT_TRUE(cache.isHere(1));
}

TEST_F(SearchTiles, ThreadsThatEvictEachOthersTilesSeeTheRightOnes) {
  TileCache cache(store_, all_, TileEngineKind::packed, bytesOf({1, 2}));
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      std::mt19937_64 random(t);
      std::uint32_t reads = 0;
      for (int i = 0; i < 2000; ++i) {
        const auto tile = static_cast<TileId>(random() % 6);
        const TileCache::Lease lease = cache.get(tile, reads);
        wrong += lease->tile->id() != tile || lease->engine->bytes() + lease->tile->bytes() != lease->bytes;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(SearchTiles, TilesReadAheadCountOnceAndOnlyWhenUsed) {
  TileCache cache(store_, all_, TileEngineKind::packed, UINT64_MAX);
  const std::vector<TileId> tiles{5, 2, 9, 2};
  EXPECT_TRUE(cache.readAhead(tiles));
  EXPECT_TRUE(cache.readAhead(tiles));
  EXPECT_EQ(store_.loads().size(), 3u);
  EXPECT_FALSE(cache.isHere(2));
  EXPECT_TRUE(cache.peek(2));
  EXPECT_FALSE(cache.peek(3));
  EXPECT_EQ(cache.get(2, reads_)->tile->id(), 2u);
  EXPECT_EQ(reads_, 1u);
  EXPECT_EQ(store_.loads(2), 1u);
}

TEST_F(SearchTiles, TilesReadAheadTakeLittleMemory) {
  std::vector<TileId> all(store_.tile_count());
  std::iota(all.begin(), all.end(), 0);
  ASSERT_GT(all.size(), 3 * TileCache::kLeastAhead);
  const auto largestOf = [&](std::span<const TileId> tiles) {
    std::uint64_t largest = 0;
    for (const TileId tile : tiles) largest = std::max(largest, store_.entry(tile).decoded_bytes);
    return largest;
  };
  TileCache cache(store_, all_, TileEngineKind::packed, 0);
  for (std::size_t first = 0; first < all.size(); first += 100)
    cache.readAhead(std::span(all).subspan(first, std::min<std::size_t>(100, all.size() - first)));
  EXPECT_LE(store_.heldBytes(), TileCache::kLeastAhead * largestOf(all));
  EXPECT_GT(store_.heldBytes(), 0u);
}

TEST_F(SearchTiles, TileThatCannotBeReadAheadIsLeftToItsUse) {
  store_.failLoads(4);
  TileCache cache(store_, all_, TileEngineKind::packed, UINT64_MAX);
  EXPECT_FALSE(cache.readAhead(std::vector<TileId>{3, 4, 5}));
  EXPECT_EQ(cache.get(3, reads_)->tile->id(), 3u);
  EXPECT_THROW(cache.get(4, reads_), CorruptTile);
}

}  // namespace
}  // namespace filiform
