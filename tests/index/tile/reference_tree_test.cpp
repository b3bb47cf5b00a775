#include "index/tile/reference_tree.h"

#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "tests/support/numbers.h"
#include "tests/support/scenes/brute_force.h"
#include "tests/support/scenes/random_cells.h"

#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::kInfinity;

TEST(ReferenceTree, AgreesWithBruteForceInsideEveryTile) {
  for (const test::NamedCells& named : test::worstCases()) {
    SCOPED_TRACE(named.name);
    CellList stream(named.cells);
    const auto store = buildTilesInMemory(stream, {.capacity = 300});
    std::mt19937_64 random(9);
    for (TileId id = 0; id < std::min<TileId>(store->tile_count(), 40); ++id) {
      const std::shared_ptr<const Tile> tile = store->load(id);
      const std::unique_ptr<TileEngine> engine = makeReferenceTree(tile);
      const std::vector<StoredSegment> segments = test::storedSegments(*tile);
      for (int i = 0; i < 10; ++i) {
        std::normal_distribution<double> jitter(0, i < 3 ? 0.0 : i < 7 ? 5.0 : 1e5);
        const Vector3d h_W = tile->position_W(static_cast<std::uint32_t>(random() % tile->node_count())) +
                             Vector3d(jitter(random), jitter(random), jitter(random));
        test::expectBruteForce(*engine, segments, store->grid(), h_W);
        if (HasFatalFailure()) return;
        Candidates best(1, 0, kInfinity);
        engine->search(h_W, best);
        EXPECT_EQ(best.sorted()[0].tile, id);
      }
    }
  }
}

TEST(ReferenceTree, KeepsSegmentsOfLengthZero) {
  CellList stream({test::isolatedNodes(4, 200, 50)});
  const auto store = buildTilesInMemory(stream, {.capacity = 1000});
  ASSERT_EQ(store->tile_count(), 1u);
  const std::shared_ptr<const Tile> tile = store->load(0);
  const auto engine = makeReferenceTree(tile);
  for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
    Candidates best(1, 0, kInfinity);
    engine->search(tile->position_W(tile->child(s)), best);
    ASSERT_EQ(best.sorted().size(), 1u);
    EXPECT_EQ(best.sorted()[0].squared_distance, 0.0);
  }
}

TEST(ReferenceTree, TilesOfOneToFourSegmentsAreSearchedWhole) {
  for (std::uint32_t n = 1; n <= 4; ++n) {
    CellList stream({test::isolatedNodes(n, n, 50)});
    const auto store = buildTilesInMemory(stream, {.capacity = 1000});
    const auto engine = makeReferenceTree(store->load(0));
    Candidates best(10, 0, kInfinity);
    engine->search(Vector3d(1, 2, 3), best);
    EXPECT_EQ(best.sorted().size(), n);
    EXPECT_GT(engine->bytes(), 0u);
  }
}

TEST(Candidates, LimitIsClosed) {
  Candidates best(2, 0.5, 4.0);
  best.offer({4.0, {0, 1}, 0, Vector3d::Zero(), 0});
  best.offer({4.5, {0, 2}, 0, Vector3d::Zero(), 0});
  EXPECT_EQ(best.bound2(), 4.0);
  ASSERT_EQ(best.sorted().size(), 1u);
  EXPECT_EQ(best.sorted()[0].segment.segment, 1u);
}

TEST(Candidates, TiesGoToTheLowestIdInAnyOrderOfArrival) {
  std::mt19937_64 random(3);
  for (const std::size_t k : {1, 3, 20}) {
    std::vector<std::uint32_t> ids(100);
    for (std::uint32_t i = 0; i < 100; ++i) ids[i] = i;
    std::shuffle(ids.begin(), ids.end(), random);
    Candidates best(k, 0, kInfinity);
    for (int repeat = 0; repeat < 2; ++repeat)
      for (const std::uint32_t id : ids) best.offer({1.0, {id / 10, id % 10}, 0, Vector3d::Zero(), 0});
    ASSERT_EQ(best.sorted().size(), k);
    for (std::uint32_t i = 0; i < k; ++i) EXPECT_EQ(best.sorted()[i].segment, (SegmentId{i / 10, i % 10}));
  }
}

TEST(TileEngine, UnknownNameIsRefusedAndTheBuiltOnesAreNamed) {
  try {
    tileEngineOf("octree");
    FAIL() << "accepted";
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("octree"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("cgal"), std::string::npos);
  }
}

}  // namespace
}  // namespace filiform
