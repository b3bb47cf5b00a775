#include "index/query/tile_finder.h"

#include "index/errors.h"
#include "index/tile/tile_engine.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <random>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

// More than one page of 4096 tiles.
const TileStore& manyTiles() {
  static const std::unique_ptr<TileStore> store = storeOf(test::randomColumn(7, 40, 500, 400), 3);
  return *store;
}

double squaredDistance(const TileStore& store, TileId tile, const Vector3d& h_W) {
  const GridBox& b = store.entry(tile).content;
  const Vector3d lo_W = store.grid().toWorld(b.lo), hi_W = store.grid().toWorld(b.hi);
  return (lo_W - h_W).cwiseMax(h_W - hi_W).cwiseMax(0.0).squaredNorm();
}

std::vector<Vector3d> points(std::uint64_t seed, int n) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-300, 300);
  std::vector<Vector3d> all;
  for (int i = 0; i < n; ++i) all.emplace_back(place(random), place(random), place(random));
  all.emplace_back(1e6, -1e5, 3);
  all.emplace_back(-1e9, 1e9, 1e12);
  return all;
}

TEST(TileFinder, ListsEveryTileWithinTheBound) {
  const TileStore& store = manyTiles();
  ASSERT_GT(store.tile_count(), 4096u);
  const TileFinder finder(store);
  for (const Vector3d& h_W : points(1, 50))
    for (const double radius_um : {0.0, 1.0, 20.0, 150.0}) {
      std::vector<bool> listed(store.tile_count(), false);
      const std::vector<TileFinder::Hit> hits = finder.within(h_W, radius_um * radius_um);
      EXPECT_TRUE(std::is_sorted(hits.begin(), hits.end()));
      for (const TileFinder::Hit& hit : hits) {
        EXPECT_FALSE(listed[hit.tile]) << "tile " << hit.tile << " listed twice";
        listed[hit.tile] = true;
        EXPECT_LE(hit.squared_distance, squaredDistance(store, hit.tile, h_W));
      }
      for (TileId tile = 0; tile < store.tile_count(); ++tile) {
        if (tile == store.long_tile()) continue;
        EXPECT_TRUE(listed[tile] || squaredDistance(store, tile, h_W) > radius_um * radius_um) << "tile " << tile;
      }
    }
}

TEST(TileFinder, WalkGivesEveryTileOnceNearestFirst) {
  const TileStore& store = manyTiles();
  const TileFinder finder(store);
  for (const Vector3d& h_W : points(2, 3)) {
    std::vector<bool> given(store.tile_count(), false);
    TileFinder::Walk walk = finder.walk(h_W);
    TileFinder::Hit last{0, -1};
    std::size_t count = 0;
    while (const auto hit = walk.next()) {
      EXPECT_LT(last, *hit);
      EXPECT_FALSE(given[hit->tile]);
      given[hit->tile] = true;
      last = *hit;
      ++count;
    }
    EXPECT_EQ(count, store.tile_count() - (store.long_tile() != kNoTile));
    EXPECT_FALSE(walk.next());
  }
}

TEST(TileFinder, WalkAgreesWithTheListAndWithAScanOfAFewTiles) {
  const auto few = storeOf(test::randomColumn(3, 5, 300, 200), 64);
  ASSERT_LE(few->tile_count(), 64u);
  for (const TileStore* store : {&manyTiles(), static_cast<const TileStore*>(few.get())}) {
    const TileFinder finder(*store);
    for (const Vector3d& h_W : points(3, 20)) {
      TileFinder::Walk walk = finder.walk(h_W);
      for (const TileFinder::Hit& hit : finder.within(h_W, 1e4)) {
        const auto next = walk.next();
        ASSERT_TRUE(next);
        EXPECT_EQ(next->tile, hit.tile);
        EXPECT_EQ(next->squared_distance, hit.squared_distance);
      }
    }
  }
}

TEST(TileFinder, KnowsWhatIsOutside) {
  const TileFinder finder(manyTiles());
  EXPECT_FALSE(finder.isOutside(Vector3d::Zero()));
  EXPECT_TRUE(finder.isOutside(Vector3d(1e5, 0, 0)));
  EXPECT_TRUE(finder.isOutside(Vector3d(0, 0, -1e5)));
}

TEST(TileFinder, EmptySetHasNoTiles) {
  const auto store = storeOf({}, 64);
  const TileFinder finder(*store);
  EXPECT_TRUE(finder.within(Vector3d::Zero(), std::numeric_limits<double>::infinity()).empty());
  EXPECT_FALSE(finder.walk(Vector3d::Zero()).next());
  EXPECT_TRUE(finder.isOutside(Vector3d::Zero()));
}

TEST(TileFinder, ReadsNoTile) {
  const test::CountingStore store(manyTiles());
  const TileFinder finder(store);
  finder.within(Vector3d::Zero(), 1e4);
  finder.walk(Vector3d::Zero()).next();
  EXPECT_TRUE(store.loads().empty());
}

// The n-th call of entry() fails once, like a page that the disk delivers at the second attempt.
class FailsOnce final : public test::CountingStore {
 public:
  FailsOnce(const TileStore& store, int at) : CountingStore(store), left_(at) {}
  const TileEntry& entry(TileId tile) const override {
    if (left_.fetch_sub(1) == 1) throw IoError("directory.bin", "an injected fault");
    return CountingStore::entry(tile);
  }

 private:
  mutable std::atomic<int> left_;
};

TEST(TileFinder, AFailureWhileAPageIsEnteredLeavesNothingBehind) {
  const TileStore& store = manyTiles();
  const Vector3d h_W(10, -20, 30);
  const std::vector<TileFinder::Hit> expected = TileFinder(store).within(h_W, 1e4);
  const auto few = storeOf(test::randomColumn(3, 5, 300, 200), 64);
  ASSERT_LE(few->tile_count(), 64u);
  const std::vector<TileFinder::Hit> expected_of_few = TileFinder(*few).within(h_W, 1e4);
  const auto pairs = [](const std::vector<TileFinder::Hit>& hits) {
    std::vector<std::pair<TileId, double>> all;
    for (const TileFinder::Hit& hit : hits) all.emplace_back(hit.tile, hit.squared_distance);
    return all;
  };
  // In a scan; in the pages of the memory store; in the first and second page entered.
  const int pages = static_cast<int>(store.tile_count());
  for (const auto& [set, at, want] :
       {std::tuple{few.get(), 5, &expected_of_few}, std::tuple{const_cast<TileStore*>(&store), 100, &expected},
        std::tuple{const_cast<TileStore*>(&store), pages + 100, &expected},
        std::tuple{const_cast<TileStore*>(&store), pages + 9000, &expected}}) {
    SCOPED_TRACE(at);
    const FailsOnce faulty(*set, at);
    const TileFinder finder(faulty);
    EXPECT_THROW(finder.within(h_W, 1e4), IoError);
    EXPECT_EQ(pairs(finder.within(h_W, 1e4)), pairs(*want));
    TileFinder::Walk walk = finder.walk(h_W);
    for (const TileFinder::Hit& hit : *want) {
      const auto next = walk.next();
      ASSERT_TRUE(next);
      EXPECT_EQ(next->tile, hit.tile);
    }
  }
}

TEST(TileFinder, ServesManyThreadsFromTheFirstQueryOn) {
  const TileFinder finder(manyTiles());
  const std::size_t expected = TileFinder(manyTiles()).within(Vector3d::Zero(), 1e4).size();
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] { wrong += finder.within(Vector3d::Zero(), 1e4).size() != expected; });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(WorldBox, DistanceIsNeverAboveThatOfAPointInside) {
  std::mt19937_64 random(5);
  SCOPED_TRACE("seed 5");
  const Grid grid;
  for (const double origin : {0.0, 1e4, 1e9})
    for (int i = 0; i < 20000; ++i) {
      std::uniform_real_distribution<double> near(-10, 10), t(0, 1);
      const auto point = [&] {
        return Vector3d(Vector3d::Constant(origin) + Vector3d(near(random), near(random), near(random)));
      };
      const Vector3d a_W = grid.toWorld(grid.snap(point())), b_W = grid.toWorld(grid.snap(point()));
      const WorldBox box{a_W.cwiseMin(b_W), a_W.cwiseMax(b_W)};
      const Vector3d h_W = point();
      EXPECT_LE(box.squaredDistanceBelow(h_W), closestPoint(a_W, b_W, h_W).squared_distance);
      EXPECT_LE(box.squaredDistanceBelow(1e8 * h_W), closestPoint(a_W, b_W, 1e8 * h_W).squared_distance);
    }
}

}  // namespace
}  // namespace filiform
