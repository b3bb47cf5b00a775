#include "index/ingest/memory_tiles.h"

#include "index/errors.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/tile_invariants.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::unique_ptr<TileStore> build(const std::vector<Cell>& cells, std::uint32_t capacity, int exponent = -9) {
  CellList stream(cells);
  return buildTilesInMemory(stream, {.capacity = capacity, .quantum_exponent = exponent});
}

TEST(MemoryTiles, RandomColumnsKeepEveryPromise) {
  for (std::uint64_t seed : {1, 2, 3})
    for (std::uint32_t capacity : {16u, 100u, 2048u}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + " capacity " + std::to_string(capacity));
      const std::vector<Cell> cells = test::randomColumn(seed, 8, 200, 150);
      test::expectTilesHold(*build(cells, capacity), cells);
    }
}

TEST(MemoryTiles, WorstCasesKeepEveryPromise) {
  for (const test::NamedCells& worst : test::worstCases()) {
    SCOPED_TRACE(worst.name);
    const auto store = build(worst.cells, 32);
    test::expectTilesHold(*store, worst.cells);
    if (worst.name == "long segment") {
      EXPECT_NE(store->long_tile(), kNoTile);
    }
  }
}

TEST(MemoryTiles, CoarseAndFineGridsKeepEveryPromise) {
  const std::vector<Cell> cells = test::randomColumn(4, 5, 150, 100);
  for (int exponent : {Grid::kMinExponent, 0, Grid::kMaxExponent}) {
    SCOPED_TRACE(exponent);
    test::expectTilesHold(*build(cells, 20, exponent), cells);
  }
}

TEST(MemoryTiles, LongSegmentHasATileOfItsOwn) {
  Cell rail = test::longNeurite(3000, 2.0);
  EXPECT_EQ(build({rail}, 16)->long_tile(), kNoTile);
  const std::uint32_t last = test::addSample(rail, rail.positions_um.back(), 0);
  const auto store = build({rail}, 16);
  ASSERT_NE(store->long_tile(), kNoTile);
  const auto tile = store->load(store->long_tile());
  EXPECT_EQ(tile->segment_count(), 1u);
  EXPECT_TRUE(tile->findSegment({0, last}));
  for (std::uint32_t n = 0; n < tile->node_count(); ++n) EXPECT_FALSE(tile->isHome(n));
}

TEST(MemoryTiles, TilingDoesNotDependOnTheOrderOfCells) {
  std::vector<Cell> cells = test::randomColumn(6, 6, 200, 100);
  const auto forward = build(cells, 32);
  std::reverse(cells.begin(), cells.end());
  const auto backward = build(cells, 32);
  ASSERT_EQ(forward->tile_count(), backward->tile_count());
  for (TileId t = 0; t < forward->tile_count(); ++t) {
    EXPECT_EQ(forward->entry(t).key, backward->entry(t).key);
    EXPECT_EQ(forward->entry(t).owned, backward->entry(t).owned);
    EXPECT_EQ(forward->entry(t).stored, backward->entry(t).stored);
  }
}

TEST(MemoryTiles, RefusesNonsense) {
  CellList nothing({});
  EXPECT_THROW(buildTilesInMemory(nothing, {.capacity = 0}), UsageError);
  Cell uneven = test::randomNeuron(1);
  uneven.types.pop_back();
  EXPECT_THROW(build({uneven}, 10), UsageError);
  Cell orphan = test::randomNeuron(1);
  orphan.parents[7] = 100000;
  EXPECT_THROW(build({orphan}, 10), UsageError);
}

}  // namespace
}  // namespace filiform
