#include "index/tile/packed_tree.h"

#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "index/tile/box_region.h"
#include "index/tile/reference_tree.h"
#include "tests/support/numbers.h"
#include "tests/support/scenes/brute_force.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/test_graph.h"

#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::kInfinity;

// Every path against brute force: near, far and very far.
void expectNearest(const std::shared_ptr<const Tile>& tile, const Grid& grid, std::mt19937_64& random, int probes) {
  if (tile->segment_count() == 0) return;
  const std::vector<StoredSegment> segments = test::storedSegments(*tile);
  for (const std::string& path : packedTreePaths()) {
    SCOPED_TRACE(path);
    const std::unique_ptr<TileEngine> engine = makePackedTree(tile, path);
    for (int i = 0; i < probes; ++i) {
      constexpr std::array<double, 8> kReach{0, 0, 0.5, 5, 50, 1e5, 1e9, 1e20};
      std::normal_distribution<double> jitter(0, kReach[static_cast<std::size_t>(i) % kReach.size()]);
      const Vector3d h_W =
          tile->position_W(static_cast<std::uint32_t>(random() % tile->node_count())) +
          (i % 8 < 2 ? Vector3d::Zero().eval() : Vector3d(jitter(random), jitter(random), jitter(random)));
      test::expectBruteForce(*engine, segments, grid, h_W);
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

TEST(PackedTree, AgreesWithBruteForceInsideEveryTile) {
  std::mt19937_64 random(9);
  for (const test::NamedCells& named : test::worstCases()) {
    SCOPED_TRACE(named.name + ", seed 9");
    CellList stream(named.cells);
    const auto store = buildTilesInMemory(stream, {.capacity = 300});
    for (TileId id = 0; id < std::min<TileId>(store->tile_count(), 20); ++id)
      expectNearest(store->load(id), store->grid(), random, 8);
  }
}

TEST(PackedTree, AgreesWithBruteForceOnGraphs) {
  std::mt19937_64 random(10);
  SCOPED_TRACE("seed 10");
  for (const double place : {0.0, 1e5, 1e9 - 1000}) {
    const test::TestGraph graph = test::randomGraph(random, 700, true, Vector3d::Constant(place));
    expectNearest(std::make_shared<const Tile>(0, BlockKey{}, false, graph.grid, graph.segments), graph.grid, random,
                  16);
  }
}

// Trees of three or more levels, more ties than a list holds, given bounds, and epsilon.
TEST(PackedTree, AgreesWithBruteForceInLargeTiles) {
  SCOPED_TRACE("seed 12");
  std::mt19937_64 random(12);
  std::vector<StoredSegment> ring;  // all equally far from the centre, in pieces of one and of nine
  for (std::uint32_t i = 0; i < 4000; ++i) {
    const double angle = 1e-3 * i;
    const GridPoint at(std::llround(1000 * std::cos(angle)), std::llround(1000 * std::sin(angle)), 5 * (i % 3));
    ring.push_back({{i % 10 == 9 ? i : i - i % 10, i}, i, i % 10 == 9 ? i : i + 1, at, at, true});
  }
  const Grid grid;
  expectNearest(std::make_shared<const Tile>(0, BlockKey{}, false, grid, ring), grid, random, 8);

  const test::TestGraph graph = test::randomGraph(random, 12000, false);
  const auto tile = std::make_shared<const Tile>(0, BlockKey{}, false, graph.grid, graph.segments);
  expectNearest(tile, graph.grid, random, 16);
  std::normal_distribution<double> jitter(0, 3);
  for (const std::string& path : packedTreePaths()) {
    const std::unique_ptr<TileEngine> engine = makePackedTree(tile, path);
    for (int i = 0; i < 50; ++i) {
      const Vector3d h_W = tile->position_W(static_cast<std::uint32_t>(random() % tile->node_count())) +
                           Vector3d(jitter(random), jitter(random), jitter(random));
      const double distance = test::bruteForceNearest(graph.segments, graph.grid, h_W, 1)[0].distance_um;
      for (const double factor : {0.5, 1 + 1e-9, 1.5}) {
        Candidates best(1, 0, factor * distance * factor * distance);
        engine->search(h_W, best);
        EXPECT_EQ(best.sorted().size(), factor < 1 ? 0u : 1u);
      }
      Candidates best(1, 0.5, kInfinity);
      engine->search(h_W, best);
      ASSERT_EQ(best.sorted().size(), 1u);
      EXPECT_LE(std::sqrt(best.sorted()[0].squared_distance), 1.5 * distance);
    }
  }
}

TEST(PackedTree, CollectsWhateverMeetsARegion) {
  CellList stream(test::randomColumn(11, 6, 300, 100));
  const auto store = buildTilesInMemory(stream, {.capacity = 5000});
  const std::shared_ptr<const Tile> tile = store->load(0);
  const auto packed = makePackedTree(tile), reference = makeReferenceTree(tile);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place(-60, 60), size(0, 30);
  for (int i = 0; i < 50; ++i) {
    const Vector3d lo_W(place(random), place(random), place(random));
    const BoxRegion region({lo_W, lo_W + Vector3d::Constant(size(random))});
    for (const TileEngine* engine : {packed.get(), reference.get()}) {
      std::vector<std::uint32_t> found;
      engine->collect(region, found);
      std::sort(found.begin(), found.end());
      EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
      for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
        const Vector3d a_W = tile->position_W(tile->child(s)), b_W = tile->position_W(tile->parent(s));
        if (region.mayMeet({a_W.cwiseMin(b_W), a_W.cwiseMax(b_W)})) {
          EXPECT_TRUE(std::binary_search(found.begin(), found.end(), s));
        }
      }
    }
  }
}

TEST(PackedTree, RefusesAPathThatTheMachineLacks) {
  const auto tile = std::make_shared<const Tile>(0, BlockKey{}, false, Grid(), std::vector<StoredSegment>{});
  EXPECT_THROW(makePackedTree(tile, "magic"), UsageError);
  Candidates best(1, 0, kInfinity);
  makePackedTree(tile)->search(Vector3d::Zero(), best);
  EXPECT_TRUE(best.sorted().empty());
}

}  // namespace
}  // namespace filiform
