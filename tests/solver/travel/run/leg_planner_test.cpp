#include "solver/travel/run/internal/leg_planner.h"

#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "index/set/tiles_ahead.h"
#include "solver/proxy/parameters.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/slow_folder.h"
#include "tests/support/temp_folder.h"

#include <chrono>
#include <memory>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

class LegPlannerTest : public ::testing::Test {
 protected:
  LegPlannerTest() {
    CellList cells(test::randomColumn(5, 1, 3000, 300));
    ingest(cells, folder_ / "a.fil", {.capacity = 16});
    auto source = std::make_unique<test::SlowFolder>(folder_ / "a.fil", true);
    slow_ = source.get();
    set_ = TileSet::open(std::move(source));
    for (TileId t = 0; t < set_->tile_count(); ++t) set_->entry(t);
    options_.route = routeChoiceOf("tour:1");
  }
  test::TempFolder folder_;
  const test::SlowFolder* slow_ = nullptr;
  std::unique_ptr<TileSet> set_;
  RunOptions options_;
};

TEST_F(LegPlannerTest, PlansLegsAheadAndTakesThemBack) {
  Itinerary itinerary(*set_, options_);
  LegPlanner planner(itinerary);
  Leg* leg = nullptr;
  while ((leg = planner.take()) == nullptr && !planner.failed()) std::this_thread::yield();
  ASSERT_NE(leg, nullptr);
  EXPECT_EQ(leg->route.cell(), 0u);
  EXPECT_TRUE(planner.giveBack(leg));
}

TEST(Itinerary, ALegHasTheReachOfItsCell) {
  const auto store = test::storeOf(test::fineAndCoarse());
  for (const bool given : {false, true}) {
    RunOptions options;
    options.route = routeChoiceOf("tour:1");
    options.method = SolverMethod::force_listing;
    if (given) options.solver.emplace();
    Itinerary itinerary(*store, options);
    bool seen[2] = {};
    for (int i = 0; i < 10; ++i) {
      const std::unique_ptr<Leg> leg = itinerary.next();
      ASSERT_EQ(leg->reach.has_value(), !given);
      if (given) continue;
      EXPECT_EQ(leg->reach->r_max_um, automaticParameters(*store, leg->route.cell()).r_max_um);
      seen[leg->route.cell()] = true;
    }
    EXPECT_TRUE(given || (seen[0] && seen[1]));
  }
}

TEST_F(LegPlannerTest, EndsWithoutReadingTheRestOfACell) {
  const auto tiles = static_cast<int>(set_->loadCellDetail(0).tiles.size());
  ASSERT_GT(tiles, 4 * static_cast<int>(TilesAhead::kRemoteTiles));
  const int before = slow_->reads;
  Itinerary itinerary(*set_, options_);
  {
    const LegPlanner planner(itinerary);
    while (slow_->reads == before) std::this_thread::yield();
  }
  EXPECT_LT(slow_->reads - before, tiles / 2);
}

}  // namespace
}  // namespace filiform::internal
