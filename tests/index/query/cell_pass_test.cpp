#include "index/query/cell_pass.h"

#include "index/errors.h"
#include "index/query/kept_tiles.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/omitting_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/variable.h"
#include "tests/support/what_of.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

// Tiles that own segments; others hold only those of their neighbours, and no cell names them.
std::size_t owningTiles(const TileStore& store) {
  std::size_t tiles = 0;
  for (TileId tile = 0; tile < store.tile_count(); ++tile) tiles += store.entry(tile).owned > 0;
  return tiles;
}

// So little that the segments of some cells of a random column wait in a file.
constexpr unsigned long long kGroupsWait = 100'000;

std::vector<std::uint32_t> allCells(const TileStore& store) {
  std::vector<std::uint32_t> cells(store.cell_count());
  std::iota(cells.begin(), cells.end(), 0u);
  return cells;
}

void expectSameCell(const CellGraph& a, const CellGraph& b) {
  const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.source, b.source);
  EXPECT_EQ(a.header, b.header);
  EXPECT_TRUE(a.positions == b.positions);
  EXPECT_EQ(a.parents, b.parents);
  EXPECT_EQ(a.links, b.links);
  EXPECT_EQ(a.sample_ids, b.sample_ids);
  EXPECT_EQ(a.block_starts, b.block_starts);
  EXPECT_EQ(a.types, b.types);
  EXPECT_EQ(a.somata.somata.size(), b.somata.somata.size());
  EXPECT_TRUE(std::equal(a.radii_um.begin(), a.radii_um.end(), b.radii_um.begin(), b.radii_um.end(), same));
  EXPECT_TRUE(
      std::equal(a.odd_radii_um.begin(), a.odd_radii_um.end(), b.odd_radii_um.begin(), b.odd_radii_um.end(), same));
}

TEST(CellPass, GivesWhatReadCellGivesInTheOrderAskedFor) {
  const std::uint64_t seed = 81;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(82, 8, 300, 100)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const auto store = storeOf(named.cells, 30);
    for (const bool with_appearance : {true, false})
      for (const std::uint64_t memory : {0ULL, 40'000ULL, kGroupsWait, 1ULL << 28}) {
        std::vector<std::uint32_t> cells = allCells(*store);
        std::shuffle(cells.begin(), cells.end(), random);
        CellPass pass(*store, cells, {.with_appearance = with_appearance, .memory_bytes = memory, .threads = 2});
        for (const std::uint32_t cell : cells) expectSameCell(pass.next(), readCell(*store, cell, with_appearance));
      }
  }
}

TEST(CellPass, DecodesEachTileOnceUnlessThereIsHardlyAnyMemory) {
  const auto store = storeOf(test::randomColumn(83, 8, 300, 100), 30);
  std::size_t last = 0;
  for (const std::uint64_t memory : {1ULL << 28, kGroupsWait, 50'000ULL, 0ULL}) {
    const test::CountingStore counting(*store);
    CellPass pass(counting, allCells(*store), {.memory_bytes = memory});
    for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell) pass.next();
    if (memory >= kGroupsWait) {
      EXPECT_EQ(counting.loads().size(), owningTiles(*store)) << memory;
    } else {
      EXPECT_GT(counting.loads().size(), last) << "less memory, more passes";
    }
    last = counting.loads().size();
  }
  std::size_t one_by_one = 0;
  for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell) one_by_one += store->cellTiles(cell).size();
  EXPECT_EQ(last, one_by_one);
}

TEST(CellPass, SegmentsThatFindNoRoomEndIt) {
  const auto store = storeOf(test::randomColumn(83, 8, 900, 100), 30);
  const test::Variable folder("TMPDIR", "/nowhere/to/wait");
  CellPass pass(*store, allCells(*store), {.memory_bytes = 200'000});
  const std::string what = test::whatOf<IoError>([&] {
    for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell) pass.next();
  });
  EXPECT_NE(what.find("cannot hold the segments of cells"), std::string::npos) << what;
}

TEST(CellPass, AMissingSampleIsNeverSilent) {
  const auto store = storeOf(test::randomColumn(84, 3, 300, 100), 30);
  const test::OmittingStore omitting(*store);
  CellPass pass(omitting, allCells(*store));
  EXPECT_THROW(pass.next(), CorruptSet);
}

TEST(CellPass, TheCheckEndsIt) {
  const auto store = storeOf(test::randomColumn(85, 3, 300, 100), 30);
  CellPass pass(*store, allCells(*store), {.check = [] { throw Interrupted("enough"); }});
  EXPECT_THROW(pass.next(), Interrupted);
}

class CountsDetails : public ForwardingStore {
 public:
  using ForwardingStore::ForwardingStore;
  CellDetail loadCellDetail(std::uint32_t id) const override {
    ++reads;
    return store_.loadCellDetail(id);
  }
  mutable std::size_t reads = 0;
};

TEST(CellPass, KeptTilesAreDecodedOnceForCellsOneByOne) {
  const auto store = storeOf(test::randomColumn(86, 8, 300, 100), 30);
  const test::CountingStore counting(*store);
  const KeptTiles kept(counting, 64 << 20);
  for (int round = 0; round < 2; ++round)
    for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell)
      expectSameCell(readCell(kept, cell, true), readCell(*store, cell, true));
  EXPECT_EQ(counting.loads().size(), owningTiles(*store));

  const KeptTiles small(counting, 20'000);
  for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell) {
    expectSameCell(readCell(small, cell, true), readCell(*store, cell, true));
    EXPECT_LE(small.bytes(), 20'000u);
  }
  EXPECT_GT(counting.loads().size(), 2 * store->tile_count());

  const CountsDetails details(*store);
  const KeptTiles again(details, 64 << 20);
  for (int round = 0; round < 2; ++round)
    for (std::uint32_t cell = 0; cell < store->cell_count(); ++cell)
      expectSameCell(readCell(again, cell, true), readCell(*store, cell, true));
  EXPECT_EQ(details.reads, store->cell_count());
}

}  // namespace
}  // namespace filiform
