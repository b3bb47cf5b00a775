#include "solver/travel/session/stepped_travel.h"

#include "index/errors.h"
#include "index/query/nearest.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

constexpr double kTick_s = 0.001;

class Stepped : public ::testing::Test {
 protected:
  Stepped() : store_(test::storeOf(test::randomColumn(11, 4, 400, 200))) {}
  static void jumpTo(const TileStore& store, SteppedTravel& travel, const Vector3d& p_W) {
    const NearestResult at = Nearest(store).find(p_W).at(0);
    travel.jump(at.tile, at.segment, at.t);
  }
  std::unique_ptr<TileStore> store_;
};

// Bounds the force, and its growth from tick to tick as ForceLaw::apply() states it.
class ForceBounds {
 public:
  explicit ForceBounds(const SteppedTravelOptions& options) : options_(options) {}
  void check(const Vector3d& force_N, const Vector3d& hand_D) {
    ASSERT_TRUE(force_N.allFinite());
    ASSERT_LE(force_N.norm(), options_.max_force_N * (1 + 1e-12));
    if (hand_D.allFinite() && hand_.allFinite()) {
      const double free_N = options_.stiffness_N_m * std::min((hand_D - hand_).norm(), kTick_s);
      const double growth_N = (100 + options_.max_force_N / 0.5) * kTick_s + free_N;
      ASSERT_LE(force_N.norm(), force_.norm() + growth_N + 1e-9);
    }
    force_ = force_N;
    hand_ = hand_D;
  }

 private:
  SteppedTravelOptions options_;
  Vector3d force_ = Vector3d::Zero(), hand_ = Vector3d::Zero();
};

TEST_F(Stepped, WithoutAPlaceThereIsNoForce) {
  SteppedTravel travel(*store_);
  EXPECT_EQ(travel.tick(Vector3d(0.01, 0, 0), kTick_s).wrench.force_N, Vector3d::Zero());
  EXPECT_FALSE(travel.place().valid());
}

TEST_F(Stepped, TheHandIsPulledToTheNeurite) {
  SteppedTravel travel(*store_);
  const Vector3d hand(0.01, 0.02, 0);
  travel.tick(hand, kTick_s);
  jumpTo(*store_, travel, {10, 20, 30});
  const NavigationTick& first = travel.tick(hand, kTick_s);
  EXPECT_LT((first.p_D - hand).norm(), 1e-9) << "the place comes under the hand";
  Vector3d pulled = hand;
  for (int i = 0; i < 1000; ++i) travel.tick(pulled += Vector3d(0, 0, 2e-5), kTick_s);
  const NavigationTick& last = travel.tick(pulled, kTick_s);
  EXPECT_GT(last.wrench.force_N.norm(), 0.05);
  EXPECT_GT(travel.residency().reads, 0U);
}

TEST_F(Stepped, TheForceIsBoundedWhateverTheHandDoes) {
  const SteppedTravelOptions options{.stiffness_N_m = 400, .max_force_N = 3};
  SteppedTravel travel(*store_, options);
  ForceBounds bounds(options);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> within(-0.06, 0.06);
  jumpTo(*store_, travel, {10, 20, 30});
  Vector3d hand = Vector3d::Zero(), aim = hand;
  for (int i = 0; i < 6000; ++i) {
    if (i % 200 == 0) aim = Vector3d(within(random), within(random), within(random));
    hand += 0.02 * (aim - hand);
    if (i % 977 == 976) hand = aim;  // 10 cm in a tick
    const bool broken = i % 613 == 612;
    const Vector3d given = broken ? Vector3d(std::numeric_limits<double>::quiet_NaN(), 0, 0) : hand;
    if (i % 1500 == 1499) jumpTo(*store_, travel, Vector3d(within(random), within(random), within(random)) * 1000);
    const NavigationTick& tick = travel.tick(given, kTick_s);
    if (broken) {
      ASSERT_EQ(tick.wrench.force_N, Vector3d::Zero());
    }
    ASSERT_NO_FATAL_FAILURE(bounds.check(tick.wrench.force_N, given));
  }
}

// After a jump, the proxy travels as in a set that has no other cell.
TEST_F(Stepped, TheReachIsThatOfTheProxysCell) {
  const std::vector<Cell> cells = test::fineAndCoarse();
  const auto both = test::storeOf(cells), fine = test::storeOf({cells[0]}), coarse = test::storeOf({cells[1]});
  const auto pathFrom = [](const TileStore& store, SteppedTravel& travel, const Vector3d& p_W) {
    travel.tick(Vector3d::Zero(), kTick_s);
    jumpTo(store, travel, p_W);
    std::vector<Vector3d> places;
    for (int i = 0; i < 3000; ++i) {
      const double turn = 0.002 * i;
      travel.tick(0.03 * Vector3d(1 - std::cos(turn), std::sin(2 * turn), std::sin(turn)), kTick_s);
      places.push_back(travel.place().p_W);
    }
    return places;
  };
  const auto alone = [&](const TileStore& store, SolverMethod method, const Vector3d& p_W) {
    SteppedTravel travel(store, {.method = method, .zoom_um = 1000});
    return pathFrom(store, travel, p_W);
  };
  for (const SolverMethod method : {SolverMethod::force, SolverMethod::force_listing}) {
    SteppedTravel travel(*both, {.method = method, .zoom_um = 1000});
    for (int round = 0; round < 2; ++round) {
      for (const auto& [store, p_W] : {std::pair(fine.get(), Vector3d(0, 0, 0)), {coarse.get(), test::kCoarse_W}}) {
        const std::vector<Vector3d> path = pathFrom(*both, travel, p_W);
        EXPECT_EQ(path, alone(*store, method, p_W)) << toString(method) << ", round " << round;
        EXPECT_NE(path, alone(*store, SolverMethod::basic, p_W)) << "the reach takes no part";
      }
    }
  }
}

TEST_F(Stepped, VirtualTimeIsRepeatable) {
  std::vector<Vector3d> runs[2];
  for (auto& forces : runs) {
    SteppedTravel travel(*store_);
    jumpTo(*store_, travel, {10, 20, 30});
    for (int i = 0; i < 1000; ++i)
      forces.push_back(travel.tick(Vector3d(3e-5 * i, 1e-5 * i, 0), kTick_s).wrench.force_N);
  }
  EXPECT_EQ(runs[0], runs[1]);
}

TEST_F(Stepped, ATileThatCannotBeReadGivesNoForceAndIsTriedAgain) {
  test::CountingStore store(*store_);
  SteppedTravel travel(store);
  const NearestResult at = Nearest(*store_).find({10, 20, 30}).at(0);
  travel.jump(at.tile, at.segment, at.t);
  for (TileId tile = 0; tile < store.tile_count(); ++tile) store.failLoads(tile);
  int failures = 0;
  for (int i = 0; i < 6000; ++i) {
    const double x_m = std::min(1e-5 * i, 0.05);
    try {
      ASSERT_TRUE(travel.tick(Vector3d(x_m, 0.5 * x_m, 0), kTick_s).wrench.force_N.allFinite());
    } catch (const CorruptTile&) {
      ++failures;
    }
  }
  EXPECT_GT(failures, 1) << "each tick tries again";
  for (TileId tile = 0; tile < store.tile_count(); ++tile) store.failLoads(tile, 0);
  const std::size_t loads = store.loads().size();
  const ResidencyCounters before = travel.residency();
  const Vector3d rested_W = travel.place().p_W;
  for (int i = 0; i < 100; ++i) {
    const NavigationTick* tick = nullptr;
    ASSERT_NO_THROW(tick = &travel.tick(Vector3d(0.05, 0.025, 0), kTick_s));
    ASSERT_FALSE(tick->frontier) << "the first tick after the store heals has its tiles";
  }
  EXPECT_EQ(travel.residency().failures, before.failures);
  EXPECT_GT(travel.residency().reads, before.reads);
  EXPECT_LE(store.loads().size(), loads + travel.residency().reads - before.reads) << "each tile is read once";
  EXPECT_GT((travel.place().p_W - rested_W).norm(), 1.0) << "the proxy goes on";
}

TEST_F(Stepped, RealTimeTicksNeitherAllocateNorWait) {
  test::CountingStore slow(*store_);
  slow.delayLoads(std::chrono::milliseconds(2));
  const SteppedTravelOptions options{.realtime = true};
  SteppedTravel travel(slow, options);
  jumpTo(*store_, travel, {10, 20, 30});
  ForceBounds bounds(options);
  for (int i = 0; i < 3000; ++i) {
    const Vector3d hand(1e-5 * i, 0, 0);
    test::NoAllocGuard guard;
    const Vector3d force_N = travel.tick(hand, kTick_s).wrench.force_N;
    const test::ForbiddenCalls calls = guard.calls();
    ASSERT_EQ(calls.total(), 0u) << calls.first;
    ASSERT_NO_FATAL_FAILURE(bounds.check(force_N, hand));
    if (i % 100 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GT(travel.residency().reads, 1U);
}

TEST_F(Stepped, RealTimeWithholdsTheForceAtATileThatCannotBeRead) {
  test::CountingStore store(*store_);
  SteppedTravel travel(store, {.realtime = true});
  const NearestResult at = Nearest(*store_).find({10, 20, 30}).at(0);
  for (TileId tile = 0; tile < store.tile_count(); ++tile)
    if (tile != at.tile) store.failLoads(tile);
  try {
    travel.jump(at.tile, at.segment, at.t);
  } catch (const CorruptTile&) {
    GTEST_SKIP() << "the place lies at a node of another tile";
  }
  bool withheld = false;
  for (int i = 0; i < 20000 && !withheld; ++i) {
    const double x_m = std::min(1e-5 * i, 0.05);
    const NavigationTick& tick = travel.tick(Vector3d(x_m, 0.5 * x_m, 0), kTick_s);
    withheld = tick.frontier && x_m > 0.01 && tick.wrench.force_N.isZero(0);
    if (tick.frontier) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(withheld);
}

TEST_F(Stepped, WrongCallsAreRefused) {
  EXPECT_THROW(SteppedTravel(*store_, {.rate_Hz = 0}), UsageError);
  EXPECT_THROW(SteppedTravel(*store_, {.stiffness_N_m = -1}), UsageError);
  EXPECT_THROW(SteppedTravel(*store_, {.max_force_N = std::nan("")}), UsageError);
  EXPECT_THROW(SteppedTravel(*store_, {.budget_bytes = 1}), UsageError);
  SteppedTravel travel(*store_);
  EXPECT_THROW(travel.tick(Vector3d::Zero(), 0), UsageError);
  EXPECT_THROW(travel.tick(Vector3d::Zero(), std::nan("")), UsageError);
  EXPECT_THROW(travel.jump(store_->tile_count(), {0, 1}, 0), UsageError);
  EXPECT_THROW(travel.jump(0, {999, 1}, 0), UsageError);
  NavigationCommand zoom;
  zoom.kind = NavigationCommand::Kind::zoom;
  zoom.factor = -1;
  EXPECT_FALSE(travel.apply(zoom));
}

}  // namespace
}  // namespace filiform
