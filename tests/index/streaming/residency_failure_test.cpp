#include "index/errors.h"
#include "index/file/faulty_source.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "tests/index/streaming/residency_fixture.h"
#include "tests/support/temp_folder.h"

#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::ResidencyTest;

// ---- failures

TEST_F(ResidencyTest, FailedTileIsListedAndTriedAgainLater) {
  store_->failLoads(4, 2);
  Residency residency(*store_, options(UINT64_MAX));
  TileReader& reader = residency.addReader("hand");
  std::vector<std::uint64_t> tries;
  for (std::uint64_t tick = 0; tick < 400; ++tick) {
    const std::size_t before = store_->loads(4);
    reader.request(4);
    residency.advance(tick, 0);
    if (store_->loads(4) > before) tries.push_back(tick);
    if (tick == 10) {
      EXPECT_EQ(residency.state(4), TileState::failed);
      ASSERT_EQ(residency.failures().size(), 1u);
      const std::string line = residency.failures()[0];
      for (const char* part : {"tile 4", "counting.pack", "16384", "injected"})
        EXPECT_NE(line.find(part), std::string::npos) << line;
    }
  }
  ASSERT_EQ(tries.size(), 3u);
  EXPECT_EQ(tries[0], 0u);
  EXPECT_GE(tries[1], 64u);
  EXPECT_GE(tries[2], tries[1] + 128);
  EXPECT_EQ(residency.state(4), TileState::resident);
  EXPECT_NE(reader.tiles().find(4), nullptr);
  EXPECT_TRUE(residency.failures().empty());
  EXPECT_EQ(residency.counters().failures, 2u);
}

TEST_F(ResidencyTest, FailedTileDoesNotHoldUpTheOthers) {
  store_->failLoads(0);
  store_->failLoads(1);
  Residency residency(*store_, options(UINT64_MAX, PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(0, 1e5));
  residency.advance(0, 0);
  const TileId long_tile = store_->long_tile();
  EXPECT_EQ(reader.tiles().size(), count() - 2 - (long_tile == 0 || long_tile == 1));
  EXPECT_EQ(residency.failures().size(), 2u);
  EXPECT_EQ(residency.counters().bytes, store_->heldBytes());
}

TEST_F(ResidencyTest, AFailedTileIsMissingWhileItIsClaimed) {
  store_->failLoads(0);
  Residency residency(*store_, options(UINT64_MAX, PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(0, 1));
  residency.advance(0, 0);
  ASSERT_EQ(residency.state(0), TileState::failed);
  EXPECT_EQ(residency.missing(), residency.failures());
  reader.publishFocus(focusOn(static_cast<TileId>(count() - 1), 1));
  residency.advance(1, 0);
  EXPECT_TRUE(residency.missing().empty());
  EXPECT_EQ(residency.failures().size(), 1U);
  reader.publishFocus(focusOn(0, 1));
  residency.advance(2, 0);
  EXPECT_EQ(residency.missing().size(), 1U);
}

class LostLists final : public test::CountingStore {
 public:
  using CountingStore::CountingStore;
  std::vector<TileId> cellTiles(std::uint32_t cell) const override {
    throw IoError("cells.bin", "cannot read cell " + std::to_string(cell));
  }
};

TEST_F(ResidencyTest, AListOfTilesIsMissingWhileAHandIsOnTheCell) {
  const LostLists store(*store_);
  Residency residency(store, options(UINT64_MAX, PrefetchPolicy::structure));
  TileReader& reader = residency.addReader("hand");
  ReaderFocus focus = focusOn(0, 1);
  focus.active_node = {0, 0};
  double now_s = 0;
  const auto serve = [&] {
    for (int i = 0; i < 20; ++i) {
      reader.publishFocus(focus);
      residency.serve(now_s += 0.01);
      reader.apply(8);
    }
  };
  serve();
  EXPECT_EQ(residency.missing().size(), 1U);
  EXPECT_EQ(residency.missing(), residency.failures());
  focus = {};
  serve();
  EXPECT_TRUE(residency.missing().empty());
  EXPECT_EQ(residency.failures().size(), 1U);
}

TEST_F(ResidencyTest, FailureAmongTilesAskedTogetherIsSaid) {
  store_->failLoads(6, 1);
  Residency residency(*store_, options(UINT64_MAX));
  residency.addReader("hand");
  const TileId tiles[] = {5, 6};
  EXPECT_FALSE(residency.loadTogether(tiles));
  EXPECT_EQ(residency.state(6), TileState::failed);
}

TEST_F(ResidencyTest, TilesAskedTogetherAreTriedAgainAtOnce) {
  store_->failLoads(6, 3);
  Residency residency(*store_, options(UINT64_MAX));
  TileReader& reader = residency.addReader("hand");
  const TileId tiles[] = {5, 6};
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(residency.loadTogether(tiles));
  EXPECT_TRUE(residency.loadTogether(tiles)) << "the store has healed; time has not moved";
  for (const TileId tile : tiles) EXPECT_NE(reader.tiles().find(tile), nullptr);
  EXPECT_EQ(store_->loads(6), 4u);
  EXPECT_EQ(store_->loads(5), 1u);
  EXPECT_EQ(residency.counters().failures, 3u);
  EXPECT_TRUE(residency.failures().empty());
}

// A set on a slow, failing disk; a proxy's active tile, seen by two more readers.
TEST_F(ResidencyTest, ActiveTileThatFailsComesBackForAllReadersWhenTheDiskHeals) {
  const test::TempFolder folder;
  CellList stream(test::randomColumn(5, 10, 500, 300));
  ingest(stream, folder / "set", {.capacity = 64});
  auto source = std::make_unique<FaultySource>(openFolder(folder / "set"), FaultPlan{});
  FaultySource& faults = *source;
  const auto set = TileSet::open(std::move(source));
  const TileId active = 5;
  const auto [file, offset] = set->place(active);
  const std::string name = file.substr(folder.path().size() + 5);
  faults.failRange(name, offset, offset + 1);

  ResidencyOptions all;
  all.prefetch = PrefetchPolicy::none;
  Residency residency(*set, all);
  std::vector<TileReader*> readers;
  for (const char* who : {"hand", "eye", "jumps"}) readers.push_back(&residency.addReader(who));
  ReaderFocus focus;
  focus.active_tile = active;
  std::uint64_t tick = 0;
  for (; tick < 300; ++tick) {
    readers[0]->publishFocus(focus);
    readers[0]->request(active);
    residency.advance(tick, 2);
    for (TileReader* reader : readers) ASSERT_EQ(reader->tiles().find(active), nullptr);
  }
  ASSERT_EQ(residency.failures().size(), 1u);
  EXPECT_NE(residency.failures()[0].find(file), std::string::npos) << residency.failures()[0];
  EXPECT_NE(residency.failures()[0].find("injected"), std::string::npos);
  EXPECT_EQ(residency.counters().failures, 3u) << "tries at 2, 66 and 194, doubling";
  faults.heal();
  for (const std::uint64_t end = tick + 600; tick < end; ++tick) {
    readers[0]->publishFocus(focus);
    residency.advance(tick, 2);
  }
  for (TileReader* reader : readers) EXPECT_NE(reader->tiles().find(active), nullptr);
  EXPECT_TRUE(residency.failures().empty());
  EXPECT_EQ(residency.state(active), TileState::resident);
}

TEST_F(ResidencyTest, EverythingArrivesFromADiskThatFailsNowAndThen) {
  const test::TempFolder folder;
  CellList stream(test::randomColumn(5, 10, 500, 300));
  ingest(stream, folder / "set", {.capacity = 64});
  auto source = std::make_unique<FaultySource>(
      openFolder(folder / "set"),
      FaultPlan{.fail_every = 5, .fail_probability = 0.3, .seed = 3, .wait = [](double) {}});
  FaultySource& faults = *source;
  const auto set = TileSet::open(std::move(source));
  set->checkDirectory();  // in virtual time, advance() throws if it cannot read a page
  faults.arm();
  Residency residency(*set, options(UINT64_MAX, PrefetchPolicy::structure));
  TileReader& reader = residency.addReader("hand");
  ReaderFocus focus = focusOn(3, 1e5);
  focus.active_node = {0, 0};
  std::uint64_t tick = 0;
  // The list of a cell's tiles may arrive after the last tile.
  for (; tick < 20000 && (reader.tiles().size() < set->tile_count() || !residency.failures().empty()); ++tick) {
    reader.publishFocus(focus);
    residency.advance(tick, 1);
  }
  EXPECT_EQ(reader.tiles().size(), set->tile_count());
  EXPECT_GT(residency.counters().failures, 10u);
  EXPECT_TRUE(residency.failures().empty());
}

// ---- the long-segment tile

class LongResidencyTest : public ResidencyTest {
 protected:
  static std::vector<Cell> crossed() {
    for (test::NamedCells& named : test::worstCases())
      for (const Cell& cell : named.cells)
        if (cell.samples() == 3 && cell.positions_um[0].x() == -2000) return named.cells;
    return {};
  }
  LongResidencyTest() : ResidencyTest(crossed(), 16) {}
};

TEST_F(LongResidencyTest, LongTileIsPinnedFromTheStart) {
  ASSERT_NE(store_->long_tile(), kNoTile);
  Residency residency(*store_, options(Residency::floorBytes(*store_), PrefetchPolicy::distance));
  EXPECT_EQ(residency.state(store_->long_tile()), TileState::resident);
  TileReader& reader = residency.addReader("hand");
  for (std::uint64_t tick = 0; tick < 100; ++tick) {
    reader.publishFocus(focusOn(static_cast<TileId>(tick * 37 % (count() - 1)), 1e4));
    residency.advance(tick, 0);
    ASSERT_NE(reader.tiles().find(store_->long_tile()), nullptr);
  }
  EXPECT_EQ(store_->loads(store_->long_tile()), 1u);
}

TEST_F(LongResidencyTest, LongTileThatCannotBeReadIsAnErrorAtOnce) {
  store_->failLoads(store_->long_tile());
  EXPECT_THROW(Residency(*store_, options(UINT64_MAX)), CorruptTile);
}

TEST_F(ResidencyTest, EmptySetServesNothing) {
  CellList stream({});
  const auto empty = buildTilesInMemory(stream);
  Residency residency(*empty, options(0, PrefetchPolicy::structure));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus({});
  reader.request(0);
  residency.advance(0, 0);
  EXPECT_FALSE(residency.serve(1));
  EXPECT_EQ(reader.tiles().size(), 0u);
}

}  // namespace
}  // namespace filiform
