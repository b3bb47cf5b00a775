#include "index/streaming/residency.h"

#include "index/build/ingest.h"
#include "index/build/memory_tiles.h"
#include "index/errors.h"
#include "index/query/tile_finder.h"
#include "index/set/faulty_source.h"
#include "index/set/tile_set.h"
#include "index/streaming/internal/prefetch.h"
#include "tests/support/campaign.h"
#include "tests/support/counting_store.h"
#include "tests/support/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <future>
#include <limits>
#include <mutex>
#include <random>
#include <set>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

constexpr int kAll = std::numeric_limits<int>::max();

class ResidencyTest : public testing::Test {
 protected:
  explicit ResidencyTest(std::vector<Cell> cells = test::randomColumn(5, 10, 500, 300), std::uint32_t capacity = 64) {
    CellList stream(std::move(cells));
    inner_ = buildTilesInMemory(stream, {.capacity = capacity});
    store_ = std::make_unique<test::CountingStore>(*inner_);
  }

  TileId count() const { return store_->tile_count(); }
  std::uint64_t bytesOf(TileId tile) const { return store_->entry(tile).decoded_bytes; }
  std::uint64_t total() const {
    std::uint64_t sum = 0;
    for (TileId tile = 0; tile < count(); ++tile) sum += bytesOf(tile);
    return sum;
  }
  ResidencyOptions options(std::uint64_t budget, PrefetchPolicy policy = PrefetchPolicy::none) const {
    return {.budget_bytes = budget, .prefetch = policy, .lookahead_s = 0.5};
  }
  Vector3d centre(TileId tile) const {
    const GridBox& b = store_->entry(tile).content;
    return 0.5 * (store_->grid().toWorld(b.lo) + store_->grid().toWorld(b.hi));
  }
  ReaderFocus focusOn(TileId tile, double radius_um = 0) const {
    ReaderFocus focus;
    focus.active_tile = tile;
    focus.p_W = centre(tile);
    focus.radius_um = radius_um;
    return focus;
  }

  std::unique_ptr<TileStore> inner_;
  std::unique_ptr<test::CountingStore> store_;
};

// ---- state by state, in real time, one serve() at a time

TEST_F(ResidencyTest, TileGoesThroughItsStatesOneByOne) {
  Residency residency(*store_, options(Residency::floorBytes(*store_)));
  TileReader& reader = residency.addReader("hand");
  EXPECT_EQ(residency.state(3), TileState::absent);
  reader.request(3);
  EXPECT_EQ(residency.state(3), TileState::absent) << "a request alone does nothing";
  EXPECT_TRUE(residency.serve(0));
  EXPECT_EQ(residency.state(3), TileState::ready);
  EXPECT_EQ(reader.tiles().find(3), nullptr);
  EXPECT_EQ(reader.apply(), 1);
  ASSERT_NE(reader.tiles().find(3), nullptr);
  EXPECT_EQ(reader.tiles().find(3)->id(), 3u);
  EXPECT_EQ(residency.state(3), TileState::ready) << "the acknowledgement was not taken yet";
  EXPECT_FALSE(residency.serve(0.001));
  EXPECT_EQ(residency.state(3), TileState::resident);

  // Other tiles evict it after the request has lapsed.
  double now = 1;
  for (TileId tile = 4; residency.state(3) == TileState::resident && tile < count(); ++tile, now += 1) {
    reader.request(tile);
    residency.serve(now);
    if (residency.state(3) == TileState::resident) reader.apply();
  }
  ASSERT_EQ(residency.state(3), TileState::retiring);
  EXPECT_NE(reader.tiles().find(3), nullptr) << "the reader still has it";
  const std::uint64_t held = store_->heldBytes();
  residency.serve(now);
  EXPECT_EQ(residency.state(3), TileState::retiring) << "freed before the reader let go";
  EXPECT_EQ(store_->heldBytes(), held);
  reader.apply();
  EXPECT_EQ(reader.tiles().find(3), nullptr);
  residency.serve(now);
  EXPECT_EQ(residency.state(3), TileState::absent);
  EXPECT_GE(residency.counters().evictions, 1u) << "a large tile may take the room of two";
}

TEST_F(ResidencyTest, QueuedTileThatNobodyWantsAnyMoreIsCancelled) {
  Residency residency(*store_, options(UINT64_MAX, PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(0, 1.0));
  residency.advance(0, 100);
  EXPECT_EQ(residency.state(0), TileState::queued);
  reader.publishFocus(focusOn(count() / 2, 1.0));
  residency.advance(1, 100);
  EXPECT_EQ(residency.state(0), TileState::absent);
  EXPECT_GT(residency.counters().cancelled, 0u);
  residency.advance(101, 100);
  EXPECT_EQ(store_->loads(0), 0u);
  EXPECT_EQ(residency.state(count() / 2), TileState::resident);
}

TEST_F(ResidencyTest, TileIsFreedOnlyAfterTheSlowestReaderLetGo) {
  Residency residency(*store_, options(Residency::floorBytes(*store_)));
  TileReader& fast = residency.addReader("hand");
  TileReader& slow = residency.addReader("eye");
  fast.request(0);
  residency.serve(0);
  fast.apply();
  residency.serve(0);
  EXPECT_EQ(residency.state(0), TileState::ready) << "one reader has not taken it";
  slow.apply();
  residency.serve(0);
  EXPECT_EQ(residency.state(0), TileState::resident);

  double now = 10;
  for (TileId tile = 1; residency.state(0) != TileState::retiring; ++tile, now += 10) {
    ASSERT_LT(tile, count());
    fast.request(tile);
    residency.serve(now);
    fast.apply();
    residency.serve(now);
  }
  const Tile* seen = slow.tiles().find(0);
  ASSERT_NE(seen, nullptr);
  EXPECT_EQ(fast.tiles().find(0), nullptr);
  for (int i = 0; i < 100; ++i) {
    fast.apply();
    residency.serve(now += 0.001);
    EXPECT_EQ(residency.state(0), TileState::retiring);
    EXPECT_EQ(seen->id(), 0u);  // the sanitizers would report a freed tile
    EXPECT_LE(residency.counters().bytes, residency.budget_bytes());
  }
  slow.apply(kAll);
  residency.serve(now);
  EXPECT_NE(residency.state(0), TileState::retiring);
}

TEST_F(ResidencyTest, ReaderAppliesNoMoreThanItWasTold) {
  Residency residency(*store_, options(UINT64_MAX));
  TileReader& reader = residency.addReader("hand");
  for (TileId tile = 0; tile < 20; ++tile) reader.request(tile);
  for (int i = 0; i < 25; ++i) residency.serve(0);
  EXPECT_EQ(reader.apply(8), 8);
  EXPECT_EQ(reader.tiles().size(), 8u);
  EXPECT_EQ(reader.apply(8), 8);
  EXPECT_EQ(reader.apply(8), 4);
  EXPECT_EQ(reader.apply(8), 0);
}

TEST_F(ResidencyTest, ReaderThatJoinsLateGetsWhatIsInMemory) {
  Residency residency(*store_, options(UINT64_MAX));
  TileReader& first = residency.addReader("hand");
  first.request(2);
  residency.advance(0, 0);
  TileReader& second = residency.addReader("eye");
  second.apply();
  EXPECT_NE(second.tiles().find(2), nullptr);
}

TEST_F(ResidencyTest, MoreMessagesThanTheRingHoldsAllArrive) {
  CellList stream(test::randomColumn(6, 10, 500, 300));
  const auto store = buildTilesInMemory(stream, {.capacity = 1});
  ASSERT_GT(store->tile_count(), 2500u);
  Residency residency(*store, options(UINT64_MAX, PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  ReaderFocus focus;
  focus.radius_um = 1e6;
  reader.publishFocus(focus);
  for (int i = 0; i < 2000; ++i) residency.serve(0);  // the reader takes no message meanwhile
  EXPECT_LE(reader.apply(kAll), 1024);
  while (residency.serve(0) || reader.apply(kAll) > 0) {
  }
  EXPECT_EQ(reader.tiles().size(), residency.counters().reads);
  EXPECT_GT(reader.tiles().size(), 1500u);
}

// ---- budget

TEST_F(ResidencyTest, BudgetBelowTheFloorIsRefusedWithTheFloor) {
  const std::uint64_t floor = Residency::floorBytes(*store_);
  try {
    Residency residency(*store_, options(floor - 1));
    FAIL() << "accepted";
  } catch (const UsageError& error) {
    EXPECT_EQ(error.what(),
              "--budget " + std::to_string(floor - 1) + " is below the floor of " + std::to_string(floor) +
                  " bytes (the two largest tiles and the long-segment tile); give at least " + std::to_string(floor));
  }
  EXPECT_NO_THROW(Residency(*store_, options(floor)));
}

TEST_F(ResidencyTest, FloorIsTheTwoLargestTiles) {
  std::vector<std::uint64_t> bytes;
  for (TileId tile = 0; tile < count(); ++tile)
    if (tile != store_->long_tile()) bytes.push_back(bytesOf(tile));
  std::sort(bytes.rbegin(), bytes.rend());
  const std::uint64_t long_bytes = store_->long_tile() == kNoTile ? 0 : bytesOf(store_->long_tile());
  EXPECT_EQ(Residency::floorBytes(*store_), bytes[0] + bytes[1] + long_bytes);
}

TEST_F(ResidencyTest, BudgetIsNeverExceeded) {
  for (const PrefetchPolicy policy : {PrefetchPolicy::none, PrefetchPolicy::distance, PrefetchPolicy::structure})
    for (const std::uint64_t extra : {std::uint64_t{0}, total() / 10, total() / 3})
      for (const std::uint64_t latency : {0u, 3u}) {
        const std::uint64_t budget = Residency::floorBytes(*store_) + extra;
        const test::CountingStore store(*inner_);
        Residency residency(store, options(budget, policy));
        TileReader& reader = residency.addReader("hand");
        std::mt19937_64 random(17);
        SCOPED_TRACE("seed 17");
        TileId active = 0;
        for (std::uint64_t tick = 0; tick < 300; ++tick) {
          if (random() % 4 == 0) active = static_cast<TileId>(random() % count());
          ReaderFocus focus = focusOn(active, 60);
          const std::shared_ptr<const Tile> tile = inner_->load(active);
          focus.active_node = tile->nodeId(static_cast<std::uint32_t>(random() % tile->node_count()));
          focus.v_W = 100 * Vector3d::Random();
          reader.publishFocus(focus);
          if (random() % 3 == 0) reader.request(static_cast<TileId>(random() % count()));
          residency.advance(tick, latency);
          if (random() % 5 == 0) {
            const TileId both[] = {active, static_cast<TileId>(random() % count())};
            residency.loadTogether(both);
          }
          const ResidencyCounters c = residency.counters();
          ASSERT_LE(c.bytes, budget);
          ASSERT_LE(c.peak_bytes, budget);
          ASSERT_EQ(store.heldBytes(), c.bytes);
        }
        EXPECT_LE(store.peakHeldBytes(), budget);
        EXPECT_GT(residency.counters().reads, 0u);
        EXPECT_GT(residency.counters().evictions + extra, 0u);
      }
}

TEST_F(ResidencyTest, PinnedTileIsNeverEvicted) {
  Residency residency(*store_, options(Residency::floorBytes(*store_), PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  const TileId pinned = 7;
  reader.publishFocus(focusOn(pinned, 200));
  residency.advance(0, 0);
  ASSERT_EQ(residency.state(pinned), TileState::resident);
  std::mt19937_64 random(23);
  for (std::uint64_t tick = 1; tick < 400; ++tick) {
    for (int i = 0; i < 5; ++i) reader.request(static_cast<TileId>(random() % count()));
    ReaderFocus focus = focusOn(static_cast<TileId>(random() % count()), 100);
    focus.active_tile = pinned;  // the focus moves, the proxy's tile stays
    reader.publishFocus(focus);
    residency.advance(tick, tick % 3);
    const TileId one[] = {static_cast<TileId>(random() % count())};
    residency.loadTogether(one);
    ASSERT_NE(reader.tiles().find(pinned), nullptr) << "tick " << tick;
  }
  EXPECT_EQ(store_->loads(pinned), 1u);
  EXPECT_GT(residency.counters().evictions, 10u);
}

TEST_F(ResidencyTest, TilesOfTwoReadersAreBothPinned) {
  Residency residency(*store_, options(Residency::floorBytes(*store_), PrefetchPolicy::distance));
  TileReader& a = residency.addReader("hand");
  TileReader& b = residency.addReader("eye");
  a.publishFocus(focusOn(1, 300));
  b.publishFocus(focusOn(count() - 2, 300));
  for (std::uint64_t tick = 0; tick < 100; ++tick) {
    a.request(static_cast<TileId>(tick % count()));
    residency.advance(tick, 0);
    ASSERT_NE(a.tiles().find(1), nullptr);
    ASSERT_NE(b.tiles().find(count() - 2), nullptr);
  }
}

TEST_F(ResidencyTest, PrefetchDoesNotThrash) {
  Residency residency(*store_, options(total() / 3, PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(5, 1e4));  // claims every tile
  residency.advance(0, 0);
  const std::uint64_t reads = residency.counters().reads;
  EXPECT_GT(reads, 1u);
  for (std::uint64_t tick = 1; tick < 500; ++tick) {
    ReaderFocus focus = focusOn(5, 1e4);
    focus.p_W.x() += tick % 2 == 0 ? 0.5 : -0.5;  // a trembling hand
    reader.publishFocus(focus);
    residency.advance(tick, 0);
  }
  EXPECT_EQ(residency.counters().reads, reads);
  EXPECT_EQ(residency.counters().evictions, 0u);
}

TEST_F(ResidencyTest, NearerTilesReplaceFartherOnes) {
  Residency residency(*store_, options(total() / 4, PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  for (const TileId place : {TileId{2}, count() - 3, count() / 2}) {
    reader.publishFocus(focusOn(place, 1e4));
    residency.advance(place, 0);
    std::vector<std::pair<double, TileId>> order;
    for (TileId tile = 0; tile < count(); ++tile) {
      const GridBox& b = store_->entry(tile).content;
      const Vector3d gap = (store_->grid().toWorld(b.lo) - centre(place))
                               .cwiseMax(centre(place) - store_->grid().toWorld(b.hi))
                               .cwiseMax(0.0);
      if (tile != store_->long_tile()) order.emplace_back(gap.norm(), tile);
    }
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < count() / 8; ++i)
      EXPECT_NE(reader.tiles().find(order[i].second), nullptr) << "rank " << i;
  }
}

// ---- virtual time

TEST_F(ResidencyTest, TileIsResidentAfterTheLatencyExactly) {
  for (const std::uint64_t latency : {0u, 1u, 7u, 1000u}) {
    Residency residency(*store_, options(UINT64_MAX));
    TileReader& reader = residency.addReader("hand");
    std::uint64_t tick = 40;
    residency.advance(tick++, latency);
    reader.request(9);
    const std::uint64_t asked = tick;
    for (; tick < asked + latency; ++tick) {
      residency.advance(tick, latency);
      ASSERT_EQ(reader.tiles().find(9), nullptr);
      ASSERT_EQ(residency.state(9), TileState::queued);
      if (tick % 3 == 0) reader.request(9);  // a repeated request changes nothing
    }
    residency.advance(tick, latency);
    EXPECT_NE(reader.tiles().find(9), nullptr);
    EXPECT_EQ(residency.state(9), TileState::resident);
  }
}

TEST_F(ResidencyTest, SkippedTicksLoadWhatCameDueMeanwhile) {
  Residency residency(*store_, options(UINT64_MAX));
  TileReader& reader = residency.addReader("hand");
  reader.request(9);
  residency.advance(10, 5);
  residency.advance(1000, 5);
  EXPECT_NE(reader.tiles().find(9), nullptr);
}

TEST_F(ResidencyTest, RunsAreTheSameEveryTime) {
  const auto run = [&] {
    const test::CountingStore store(*inner_);
    Residency residency(store, options(total() / 4, PrefetchPolicy::structure));
    TileReader& reader = residency.addReader("hand");
    std::mt19937_64 random(77);
    for (std::uint64_t tick = 0; tick < 200; ++tick) {
      reader.publishFocus(focusOn(static_cast<TileId>(random() % count()), 50));
      residency.advance(tick, 2);
    }
    return store.loads();
  };
  EXPECT_EQ(run(), run());
}

TEST_F(ResidencyTest, TogetherIsAllOrNothing) {
  const std::uint64_t budget = Residency::floorBytes(*store_);
  Residency residency(*store_, options(budget));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(0));
  residency.advance(0, 0);

  std::vector<TileId> many;
  for (TileId tile = 1; tile < count(); ++tile) many.push_back(tile);
  const ResidencyCounters before = residency.counters();
  EXPECT_FALSE(residency.loadTogether(many));
  EXPECT_EQ(residency.counters().reads, before.reads);
  EXPECT_EQ(residency.counters().evictions, before.evictions);

  for (TileId tile = 1; tile < count(); ++tile) {
    const TileId pair[] = {tile, 0, tile};
    ASSERT_TRUE(residency.loadTogether(pair)) << "tile " << tile;
    ASSERT_NE(reader.tiles().find(tile), nullptr);
    ASSERT_NE(reader.tiles().find(0), nullptr);
  }
  EXPECT_TRUE(residency.loadTogether({}));
  const TileId unknown[] = {count()};
  EXPECT_FALSE(residency.loadTogether(unknown));
}

TEST_F(ResidencyTest, TilesAskedTogetherOutlastPrefetch) {
  Residency residency(*store_, options(total() / 4, PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(0, 1e4));
  residency.advance(0, 0);
  TileId far = 0;
  for (TileId tile = 0; tile < count(); ++tile)
    if (tile != store_->long_tile() && (centre(tile) - centre(0)).norm() > (centre(far) - centre(0)).norm()) far = tile;
  ASSERT_EQ(reader.tiles().find(far), nullptr);
  const TileId together[] = {far};
  ASSERT_TRUE(residency.loadTogether(together));
  for (std::uint64_t tick = 1; tick < 200; ++tick) {
    ReaderFocus focus = focusOn(0, 1e4);
    focus.p_W.x() += 5.0 * static_cast<double>(tick % 7);
    focus.radius_um += static_cast<double>(tick % 2);
    reader.publishFocus(focus);
    residency.advance(tick, 0);
    ASSERT_NE(reader.tiles().find(far), nullptr) << "tick " << tick;
  }
  EXPECT_EQ(store_->loads(far), 1u);
}

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
      const TileId one[] = {4};
      EXPECT_FALSE(residency.loadTogether(one));
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

TEST_F(ResidencyTest, FailureAmongTilesAskedTogetherIsSaid) {
  store_->failLoads(6, 1);
  Residency residency(*store_, options(UINT64_MAX));
  residency.addReader("hand");
  const TileId tiles[] = {5, 6};
  EXPECT_FALSE(residency.loadTogether(tiles));
  EXPECT_EQ(residency.state(6), TileState::failed);
  residency.advance(100, 0);
  EXPECT_TRUE(residency.loadTogether(tiles));
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
  faults.arm();
  Residency residency(*set, options(UINT64_MAX, PrefetchPolicy::structure));
  TileReader& reader = residency.addReader("hand");
  ReaderFocus focus = focusOn(3, 1e5);
  focus.active_node = {0, 0};
  std::uint64_t tick = 0;
  for (; tick < 20000 && reader.tiles().size() < set->tile_count(); ++tick) {
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

// ---- holds

TEST_F(ResidencyTest, TargetOfAJumpIsLoadedFirstAndKept) {
  Residency residency(*store_, options(Residency::floorBytes(*store_), PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(0, 1e4));
  for (std::uint64_t tick = 0; tick < 10; ++tick) residency.advance(tick, 3);
  const TileId target = count() - 2, more[] = {target, count() / 2, count() / 3, count() / 4};
  const HoldId hold = residency.hold(more, HoldKind::target);
  EXPECT_FALSE(residency.isHeld(hold));
  for (std::uint64_t tick = 10; tick < 13; ++tick) {
    residency.advance(tick, 3);
    EXPECT_FALSE(residency.isHeld(hold)) << "tick " << tick;
  }
  residency.advance(13, 3);
  EXPECT_TRUE(residency.isHeld(hold)) << "the first is there, and the budget has no room for all";
  EXPECT_NE(reader.tiles().find(target), nullptr);
  EXPECT_NE(reader.tiles().find(0), nullptr) << "the hand's own tile stays";
  for (std::uint64_t tick = 14; tick < 300; ++tick) {
    reader.publishFocus(focusOn(0, 1e4 + static_cast<double>(tick % 3)));
    reader.request(static_cast<TileId>(tick * 7 % count()));
    residency.advance(tick, 3);
    ASSERT_NE(reader.tiles().find(target), nullptr) << "tick " << tick;
  }
  residency.release(hold);
  EXPECT_FALSE(residency.isHeld(hold));
  for (std::uint64_t tick = 300; tick < 1000; ++tick) {
    reader.publishFocus(focusOn(0, 1e4 + static_cast<double>(tick % 3)));
    reader.request(static_cast<TileId>(tick * 7 % count()));
    residency.advance(tick, 3);
  }
  EXPECT_EQ(reader.tiles().find(target), nullptr) << "kept although nobody holds it";
}

TEST_F(ResidencyTest, CellThatIsHeldOutranksTheSurroundingsOnly) {
  const std::vector<TileId> of_cell = store_->loadCellDetail(3).tiles;
  std::uint64_t bytes = 0;
  for (const TileId tile : of_cell) bytes += bytesOf(tile);
  ASSERT_LT(bytes + 4 * Residency::floorBytes(*store_), total());
  // With room for occasional requests too.
  Residency residency(*store_, options(bytes + 4 * Residency::floorBytes(*store_), PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(0, 1e4));
  for (std::uint64_t tick = 0; tick < 5; ++tick) residency.advance(tick, 0);
  const HoldId hold = residency.hold(of_cell, HoldKind::cell);
  for (std::uint64_t tick = 5; tick < 500; ++tick) {
    const auto place = static_cast<TileId>(tick / 10 % count());
    reader.publishFocus(focusOn(place, 1e4));
    if (tick % 50 == 0) reader.request(place);
    residency.advance(tick, 0);
    if (tick > 6) {
      ASSERT_TRUE(residency.isHeld(hold)) << "tick " << tick;
      for (const TileId tile : of_cell) ASSERT_NE(reader.tiles().find(tile), nullptr) << "tick " << tick;
    }
    ASSERT_LE(residency.counters().peak_bytes, residency.budget_bytes());
  }
}

TEST_F(ResidencyTest, HoldOfUnknownTilesIsHarmless) {
  Residency residency(*store_, options(UINT64_MAX));
  residency.addReader("hand");
  const TileId beyond[] = {count(), kNoTile};
  const HoldId hold = residency.hold(beyond, HoldKind::target);
  residency.advance(0, 0);
  EXPECT_TRUE(residency.isHeld(hold)) << "nothing is missing";
  residency.release(hold);
  residency.release(hold);
  EXPECT_FALSE(residency.isHeld(hold));
  EXPECT_FALSE(residency.isHeld(12345));
}

TEST_F(ResidencyTest, TargetThatFailsIsWaitedFor) {
  store_->failLoads(6, 1);
  Residency residency(*store_, options(UINT64_MAX));
  residency.addReader("hand");
  const TileId target[] = {6};
  const HoldId hold = residency.hold(target, HoldKind::target);
  residency.advance(0, 0);
  EXPECT_FALSE(residency.isHeld(hold));
  EXPECT_EQ(residency.state(6), TileState::failed);
  for (std::uint64_t tick = 1; tick < 200; ++tick) residency.advance(tick, 0);
  EXPECT_TRUE(residency.isHeld(hold));
}

TEST_F(ResidencyTest, JumpIsReadyWhenItsSurroundingsAreThere) {
  for (const PrefetchPolicy policy : {PrefetchPolicy::none, PrefetchPolicy::distance, PrefetchPolicy::structure}) {
    Residency residency(*store_, options(UINT64_MAX, policy));
    TileReader& reader = residency.addReader("hand");
    ReaderFocus focus = focusOn(0, 100);
    const TileId far = count() - 2;
    const std::shared_ptr<const Tile> tile = inner_->load(far);
    std::uint32_t node = 0;
    while (!tile->isHome(node)) ++node;
    focus.target_tile = far;
    focus.target_node = tile->nodeId(node);
    focus.target_W = tile->position_W(node);
    std::uint64_t tick = 0;
    for (; !reader.isTargetReady(focus.target_node); ++tick) {
      ASSERT_LT(tick, 1000u);
      reader.publishFocus(focus);
      residency.advance(tick, 5);
    }
    EXPECT_NE(reader.tiles().find(far), nullptr);
    EXPECT_GE(tick, 6u);
    EXPECT_FALSE(reader.isTargetReady({1000, 0}));
    // All tiles that can be reached within 0.1 s are present.
    if (policy == PrefetchPolicy::none) continue;
    ReaderFocus there = focus;
    there.active_tile = far;
    there.active_node = focus.target_node;
    there.p_W = focus.target_W;
    there.target_tile = kNoTile;
    reader.publishFocus(there);
    const std::uint64_t misses = residency.counters().misses();
    const TileFinder finder(*store_);
    const Prefetch prefetch(*store_, finder, policy, 0.5);
    std::vector<TileClaim> claims;
    if (policy == PrefetchPolicy::structure)
      prefetch.claimAhead(there, reader.tiles(), {}, UINT64_MAX, claims);
    else
      for (const TileFinder::Hit& hit : finder.within(there.p_W, 15.0 * 15.0)) claims.push_back({hit.tile, 0});
    EXPECT_FALSE(claims.empty());
    for (const TileClaim& c : claims)
      if (c.cost < 0.09) {
        EXPECT_NE(reader.tiles().find(c.tile), nullptr) << "policy " << static_cast<int>(policy);
      }
    EXPECT_EQ(residency.counters().misses(), misses);
    residency.advance(tick, 5);
    residency.advance(tick + 1, 5);
    EXPECT_FALSE(reader.isTargetReady(focus.target_node)) << "no jump waits any more";
  }
}

TEST_F(ResidencyTest, SurroundingsOfTheEyeComeAfterThoseOfTheHand) {
  Residency residency(*store_, options(total() / 3, PrefetchPolicy::distance));
  TileReader& hand = residency.addReader("hand");
  TileReader& eye = residency.addReader("eye");
  ReaderFocus looks = focusOn(count() - 2, 1e4);
  looks.active_tile = kNoTile;
  looks.is_view = true;
  eye.publishFocus(looks);
  hand.publishFocus(focusOn(0, 60));
  for (std::uint64_t tick = 0; tick < 5; ++tick) residency.advance(tick, 0);
  // All tiles around the proxy are present, and the camera gets the rest of the budget.
  const TileFinder finder(*store_);
  for (const TileFinder::Hit& hit : finder.within(centre(0), 60.0 * 60.0))
    EXPECT_NE(hand.tiles().find(hit.tile), nullptr);
  EXPECT_NE(eye.tiles().find(count() - 2), nullptr);
}

// ---- counters

TEST_F(ResidencyTest, MissesAreCountedByTheirCause) {
  const std::uint64_t budget = Residency::floorBytes(*store_);
  store_->failLoads(9);
  Residency residency(*store_, options(budget));
  TileReader& reader = residency.addReader("hand");
  std::uint64_t tick = 0;
  reader.request(3);
  residency.advance(tick, 10);
  EXPECT_EQ(residency.counters().missed_unclaimed, 1u);
  reader.request(3);
  residency.advance(++tick, 10);
  EXPECT_EQ(residency.counters().misses(), 1u) << "asking again is no new miss";
  EXPECT_EQ(residency.counters().queued, 1u);
  for (; tick < 12; ++tick) residency.advance(tick, 10);
  EXPECT_EQ(residency.counters().queued, 0u);
  EXPECT_EQ(residency.counters().waits, 1u + (store_->long_tile() != kNoTile));
  EXPECT_EQ(residency.counters().wait_most, 10.0);
  for (TileId tile = 4; residency.state(3) != TileState::absent; ++tile) {
    tick += 1000;
    ASSERT_LT(tile, 9u);
    reader.request(tile);
    residency.advance(tick, 0);
  }
  reader.request(3);
  residency.advance(++tick, 0);
  EXPECT_EQ(residency.counters().missed_evicted, 1u);
  reader.request(9);
  residency.advance(tick += 1000, 0);
  residency.advance(tick += 1000, 0);
  reader.request(9);
  residency.advance(++tick, 0);
  EXPECT_EQ(residency.counters().missed_failed, 1u);
}

TEST_F(ResidencyTest, PrefetchIsCountedAsUsedOrWasted) {
  Residency residency(*store_, options(total() / 4, PrefetchPolicy::distance));
  TileReader& reader = residency.addReader("hand");
  reader.publishFocus(focusOn(0, 1e4));
  residency.advance(0, 0);
  ResidencyCounters c = residency.counters();
  EXPECT_GT(c.prefetched, 3u);
  EXPECT_EQ(c.prefetch_used, 0u);
  TileId neighbour = 1;
  while (residency.state(neighbour) != TileState::resident) ++neighbour;
  reader.publishFocus(focusOn(neighbour, 1e4));
  residency.advance(1, 0);
  EXPECT_EQ(residency.counters().prefetch_used, 1u);
  EXPECT_EQ(residency.counters().entered, 1u);
  for (TileId tile = 0; tile < count(); ++tile) {
    reader.publishFocus(focusOn(tile, 1e4));
    residency.advance(100 + tile, 0);
  }
  c = residency.counters();
  EXPECT_GT(c.prefetch_wasted, 0u);
  EXPECT_LE(c.prefetch_used + c.prefetch_wasted, c.prefetched);
}

// ---- threads

TEST_F(ResidencyTest, ThreadIsStartedOnceAndStoppedAsOftenAsOneLikes) {
  Residency residency(*store_, options(UINT64_MAX));
  residency.addReader("hand");
  residency.start();
  EXPECT_THROW(residency.start(), std::logic_error);
  EXPECT_THROW(residency.serve(0), std::logic_error);
  EXPECT_THROW(residency.advance(0, 0), std::logic_error);
  EXPECT_THROW(residency.addReader("late"), std::logic_error);
  residency.stop();
  residency.stop();
  residency.start();
}

// A store whose entries cannot be read for some time.
class LostDirectory final : public test::CountingStore {
 public:
  using CountingStore::CountingStore;
  const TileEntry& entry(TileId tile) const override {
    if (lost) throw IoError("directory.bin", "cannot be read");
    return CountingStore::entry(tile);
  }
  std::atomic<bool> lost{false};
};

TEST_F(ResidencyTest, ADirectoryThatCannotBeReadIsReportedAndTriedAgain) {
  LostDirectory store(*store_);
  Residency residency(store, options(UINT64_MAX));
  TileReader& reader = residency.addReader("hand");
  store.lost = true;
  residency.start();
  const auto wait = [&](auto until) {
    for (int i = 0; i < 20000 && !until(); ++i) {
      reader.apply(8);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return until();
  };
  reader.publishFocus(focusOn(3, 80));
  EXPECT_TRUE(wait([&] { return !residency.failures().empty(); }));
  EXPECT_EQ(reader.tiles().size(), 0u);
  store.lost = false;
  EXPECT_TRUE(wait([&] { return reader.tiles().find(3) != nullptr; }));
  EXPECT_TRUE(wait([&] { return residency.failures().empty(); }));
}

// Reads wait until they are answered.
class SilentDisk {
 public:
  void wait() {
    std::unique_lock lock(mutex_);
    const int mine = answers_;
    ++waiting_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return answers_ != mine || healed_; });
  }
  bool isWaitedFor() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] { return waiting_ > 0; });
  }
  void answer(bool for_ever = false) {  // the waiting reads
    const std::lock_guard lock(mutex_);
    ++answers_;
    waiting_ = 0;
    healed_ |= for_ever;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int waiting_ = 0, answers_ = 0;
  bool healed_ = false;
};

TEST_F(ResidencyTest, NobodyElseWaitsWhileTheDiskIsSilent) {
  const test::TempFolder folder;
  {
    CellList cells(test::randomColumn(5, 10, 500, 300));
    ingest(cells, folder / "a.fil", {.capacity = 64});
  }
  for (const PrefetchPolicy policy : {PrefetchPolicy::distance, PrefetchPolicy::structure})
    for (const unsigned threads : {1u, 2u}) {
      SilentDisk disk;
      auto source = std::make_unique<FaultySource>(
          openFolder(folder / "a.fil"),
          FaultPlan{.delay = FaultPlan::Delay::constant, .delay_s = 1, .wait = [&](double) { disk.wait(); }});
      FaultySource& faults = *source;
      const auto set = TileSet::open(std::move(source));
      ASSERT_GT(set->tile_count(), 64u);
      ResidencyOptions how = options(UINT64_MAX, policy);
      how.io_threads = threads;
      Residency residency(*set, how);
      TileReader& reader = residency.addReader("hand");
      faults.arm();
      residency.start();
      ReaderFocus focus;
      focus.active_tile = 3;
      focus.active_node = {2, 0};
      focus.radius_um = 50;
      reader.publishFocus(focus);
      // The first reads are the cell's list (structure) and the directory; tiles follow.
      for (int step = 0; step < 3; ++step) {
        SCOPED_TRACE(step);
        const bool waited_for = disk.isWaitedFor();
        EXPECT_TRUE(waited_for);
        auto asked = std::async(std::launch::async, [&] {
          const HoldId hold = residency.hold(std::vector<TileId>{1}, HoldKind::cell);
          residency.isHeld(hold);
          residency.release(hold);
          return residency.counters().reads + residency.failures().size() +
                 (residency.state(3) == TileState::resident ? 1 : 0);
        });
        const bool answered = asked.wait_for(std::chrono::seconds(30)) == std::future_status::ready;
        EXPECT_TRUE(answered) << "the lock is held during a read";
        disk.answer(!answered || !waited_for);
        asked.get();
        if (!answered || !waited_for) break;
      }
      disk.answer(true);
      for (int i = 0; i < 20000 && reader.tiles().find(3) == nullptr; ++i) {
        reader.apply(8);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      EXPECT_NE(reader.tiles().find(3), nullptr);
      residency.stop();
      EXPECT_TRUE(residency.failures().empty());
    }
}

class ThreadedResidency : public ResidencyTest, public testing::WithParamInterface<unsigned> {};
INSTANTIATE_TEST_SUITE_P(IoThreads, ThreadedResidency, testing::Values(1u, 4u));

TEST_P(ThreadedResidency, KeepsEveryPromiseUnderLoad) {
  const std::uint64_t budget = Residency::floorBytes(*store_) + total() / 5;
  store_->failLoads(3);
  store_->jitterLoads(std::chrono::microseconds(300));
  ResidencyOptions many = options(budget, PrefetchPolicy::structure);
  many.io_threads = GetParam();
  Residency residency(*store_, many);
  std::vector<TileReader*> readers = {&residency.addReader("hand"), &residency.addReader("eye")};
  residency.start();
  std::atomic<bool> done{false};
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (std::size_t r = 0; r < readers.size(); ++r)
    threads.emplace_back([&, r] {
      std::mt19937_64 random(100 + r);
      TileReader& reader = *readers[r];
      while (!done) {
        const auto active = static_cast<TileId>(random() % count());
        ReaderFocus focus = focusOn(active, 80);
        focus.active_node = {0, static_cast<std::uint32_t>(random() % 400)};
        reader.publishFocus(focus);
        for (int i = 0; i < 40; ++i) {
          // Sometimes a reader pauses, and its messages wait.
          if (random() % 64 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
          reader.apply(r == 0 ? 8 : 1);
          const auto id = static_cast<TileId>(random() % count());
          if (const Tile* tile = reader.tiles().find(id)) {
            wrong += tile->id() != id || tile->segment_count() == 0;
          } else {
            reader.request(id);
          }
          std::this_thread::sleep_for(std::chrono::microseconds(50));
        }
      }
    });
  // Until enough has happened, however slow the machine.
  const std::uint64_t enough = test::wholeCampaign() ? 100000 : 1500;
  while (residency.counters().reads < enough && wrong == 0) {
    const ResidencyCounters c = residency.counters();
    wrong += c.bytes > budget || c.peak_bytes > budget;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  done = true;
  for (std::thread& thread : threads) thread.join();
  residency.stop();
  EXPECT_EQ(wrong, 0);
  EXPECT_LE(store_->peakHeldBytes(), budget);
  EXPECT_GT(residency.counters().evictions, 100u);
  EXPECT_EQ(residency.failures().size(), 1u);
  test::tell(std::to_string(residency.counters().reads) + " tiles read by " + std::to_string(GetParam()) +
             " IO threads for two readers, " + std::to_string(residency.counters().evictions) +
             " let go again: every promise kept, budget never exceeded");
}

}  // namespace
}  // namespace filiform
