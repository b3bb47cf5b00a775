#include "index/streaming/residency.h"

#include "index/errors.h"
#include "tests/index/streaming/residency_fixture.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::ResidencyTest;

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
  slow.apply(test::kAllMessages);
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
  EXPECT_LE(reader.apply(test::kAllMessages), 1024);
  while (residency.serve(0) || reader.apply(test::kAllMessages) > 0) {
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

}  // namespace
}  // namespace filiform
