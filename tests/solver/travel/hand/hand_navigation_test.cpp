#include "solver/travel/hand/internal/hand_navigation.h"

#include "index/output.h"
#include "index/query/nearest.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

constexpr double kStep_s = 0.001;
constexpr int kTicks = 1500;

// The hand moves on a wide curve, so that the proxy passes through many tiles.
DeviceState stateAt(int tick) {
  DeviceState state;
  state.status = DeviceStatus::ready;
  state.time_s = kStep_s * tick;
  const double turn_rad = 0.004 * tick;
  state.p_D = 0.05 * Vector3d(std::sin(turn_rad), std::sin(0.7 * turn_rad), std::sin(0.3 * turn_rad));
  return state;
}

// A hand at the place nearest to the origin, with a device of this name and tiles of this kind.
struct Hand {
  Hand(const TileStore& store, TileKind kind, const std::string& name = "null", const std::string& record = {})
      : device({.name = name}),
        tiles(store, kind, {.prefetch = PrefetchPolicy::none}),
        travel(store, tiles, device, makeProxySolver(SolverMethod::climb, {}), {}) {
    if (!record.empty()) device.record({.path = record, .device = name});
    const NearestResult nearest = Nearest(store).find({0, 0, 0}).at(0);
    tiles.loadTogether({&nearest.tile, 1});
    NavigationCommand jump;
    jump.kind = NavigationCommand::Kind::jump;
    jump.place = travel.graph().placeAt(nearest.tile, nearest.segment, nearest.t);
    EXPECT_TRUE(travel.navigation().apply(jump, Vector3d::Zero()));
    device->open();
  }

  TravelDevice device;
  HandTiles tiles;
  HandNavigation travel;
};

std::unique_ptr<TileStore> smallTiles() { return test::storeOf(test::randomColumn(7, 4, 1200, 150), 32); }

TEST(HandNavigation, LoadedOnDemandTheTicksAreThoseOfTheWholeGraph) {
  const auto store = smallTiles();
  Hand whole(*store, TileKind::held), resident(*store, TileKind::resident), replay(*store, TileKind::replay);
  for (int tick = 0; tick < kTicks; ++tick) {
    const DeviceState state = stateAt(tick);
    const NavigationTick& expected = whole.travel.tick(state, kStep_s);
    EXPECT_FALSE(expected.frontier);
    for (Hand* const hand : {&resident, &replay}) {
      const NavigationTick& got =
          hand == &replay ? hand->travel.tickAsRecorded(state, kStep_s) : hand->travel.tickWithItsTiles(state, kStep_s);
      ASSERT_FALSE(got.frontier) << tick;
      ASSERT_EQ(got.p_W, expected.p_W) << tick;
      ASSERT_EQ(got.wrench.force_N, expected.wrench.force_N) << tick;
      hand->travel.publish(hand->travel.navigation().focus());
    }
  }
  EXPECT_EQ(whole.travel.stalls(), 0u);
  EXPECT_GT(resident.travel.stalls(), 3u);
  EXPECT_EQ(replay.travel.stalls(), resident.travel.stalls());
}

// A recording with frontiers, replayed with all tiles in memory, or with tiles loaded when they are needed.
TEST(HandNavigation, AReplayMeetsTheTilesAbsentThatTheRecordedTickMetAbsent) {
  const test::TempFolder folder;
  const auto store = smallTiles();
  std::vector<Vector3d> p_W;
  std::size_t frontiers = 0;
  {
    Hand live(*store, TileKind::resident, "null", folder / "a.rec");
    for (int tick = 0; tick < kTicks; ++tick) {
      live.device->exchange({});
      live.tiles.residency()->advance(tick, 40);
      const NavigationTick& ticked = live.travel.tick(stateAt(tick), kStep_s);
      live.travel.publish(live.travel.navigation().focus());
      frontiers += ticked.frontier;
      p_W.push_back(ticked.p_W);
    }
    live.device.recorder()->finish();
    live.device.recording()->finish();
  }
  ASSERT_GT(frontiers, 10u);
  for (const TileKind kind : {TileKind::held, TileKind::replay}) {
    Hand replay(*store, kind, "replay:" + folder / "a.rec");
    ASSERT_TRUE(replay.device.replaysMarks());
    EXPECT_EQ(replay.device.heldDevice(), "null");
    std::size_t met = 0;
    for (int tick = 0; tick < kTicks; ++tick) {
      replay.device->exchange({});
      ASSERT_TRUE(replay.device.wasTicked());
      const NavigationTick& ticked = replay.travel.tickAsRecorded(stateAt(tick), kStep_s);
      ASSERT_EQ(ticked.p_W, p_W[static_cast<std::size_t>(tick)]) << tick;
      met += ticked.frontier;
    }
    EXPECT_EQ(met, frontiers);
    EXPECT_EQ(replay.travel.uncertain_ticks(), 0u);
  }
}

TEST(HandNavigation, ATickIsHapticSafe) {
  const test::TempFolder folder;
  const auto store = smallTiles();
  Hand hand(*store, TileKind::resident, "null", folder / "a.rec");
  std::uint32_t calls = 0;
  std::string first;
  for (int tick = 0; tick < 300; ++tick) {
    hand.device->exchange({});
    const DeviceState state = stateAt(tick);
    test::NoAllocGuard guard;
    hand.travel.tick(state, kStep_s);
    hand.travel.publish(hand.travel.navigation().focus());
    hand.travel.prepare(kStep_s);
    const test::ForbiddenCalls forbidden = guard.calls();
    if (forbidden.total() > 0) first = forbidden.first;
    calls += forbidden.total();
  }
  EXPECT_EQ(calls, 0u) << first;
}

}  // namespace
}  // namespace filiform::internal
