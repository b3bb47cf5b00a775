#include "index/query/tile_finder.h"
#include "index/streaming/internal/prefetch.h"
#include "tests/index/streaming/residency_fixture.h"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::ResidencyTest;

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
  EXPECT_EQ(reader.tiles().find(target), nullptr) << "the tile is kept, although its hold has ended";
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
    const internal::KnownPages pages(*store_);
    const Prefetch prefetch(pages, finder, policy, 0.5);
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

}  // namespace
}  // namespace filiform
