#include "solver/proxy/bounded_climb.h"

#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/climb_oracle.h"
#include "tests/support/scenes/oracle_walk.h"
#include "tests/support/scenes/proxy_walk.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/store_graph.h"
#include "tests/support/scenes/test_graph.h"

#include <cmath>
#include <limits>
#include <memory>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

constexpr double kScales_um_m[] = {800, 2500, 8000, 80000};

std::unique_ptr<ProxySolver> climber(std::uint32_t max_visited = 256, const ClimbParameters& climb = {}) {
  SolverParameters parameters;
  parameters.max_visited = max_visited;
  parameters.climb = climb;
  return makeProxySolver(SolverMethod::climb, parameters);
}

double eps(double distance) { return std::max(1e-9, 1e-12 * distance); }

std::vector<ProbeState> probesFor(const WholeGraph& whole, std::mt19937_64& random, int smooth, int jumping) {
  std::vector<ProbeState> probes;
  const double scale_um_m = kScales_um_m[random() % 4], leap = random() % 3 == 0 ? 0.2 : 1;
  for (const Vector3d& h_W : smoothProbes(whole, random, smooth)) {
    const std::uint64_t held = random() % 4 == 0 ? 10 : 1;  // so that the patience grows
    for (std::uint64_t i = 0; i < held; ++i) probes.push_back({h_W, 1e-3, scale_um_m, leap});
  }
  for (const Vector3d& h_W : jumpingProbes(whole, random, jumping))
    probes.push_back({h_W, 1e-2, kScales_um_m[random() % 4]});
  return probes;
}

class WatchedClimbOracle final : public Oracle {
 public:
  WatchedClimbOracle(const WholeGraph& whole, const ClimbParameters& parameters, std::uint64_t& climbed)
      : oracle_(whole, parameters), climbed_(climbed) {}
  ProxyPlace place() const override { return oracle_.place(); }
  void setPlace(const ProxyPlace& place) override { oracle_.setPlace(place); }
  std::uint32_t advance(const ProbeState& probe) override {
    const std::uint32_t visited = oracle_.advance(probe);
    EXPECT_LE(oracle_.climbed_um(), oracle_.budget_um());
    climbed_ += oracle_.climbed_um() > 0;
    return visited;
  }

 private:
  ClimbOracle oracle_;
  std::uint64_t& climbed_;
};

// `climbed` counts the ticks that rose.
WalkedMethod walkedClimb(std::uint64_t& climbed) {
  const auto of = [](std::uint64_t variant) {
    return variant == 0 ? ClimbParameters{} : ClimbParameters{.rest_mm = 0.05, .gain = 1};
  };
  return {[of](std::uint64_t variant, std::uint32_t max_visited) { return climber(max_visited, of(variant)); },
          [of, &climbed](std::uint64_t variant, const WholeGraph& whole) {
            return std::make_unique<WatchedClimbOracle>(whole, of(variant), climbed);
          },
          [](const WholeGraph& whole, std::mt19937_64& random) { return probesFor(whole, random, 40, 20); }, 20000,
          false};
}

TEST(BoundedClimb, EqualsTheLiteralOracleInEveryTiling) {
  Walked result;
  std::uint64_t climbed = 0;
  walkInEveryTiling(walkedClimb(climbed), 120, result);
  EXPECT_GT(result.moved, 2000u);
  EXPECT_GT(climbed, 200u);
  EXPECT_GT(result.farthest, 50u);
}

TEST(BoundedClimb, EqualsTheLiteralOracleOnTheTilesOfTheProduct) {
  Walked result;
  std::uint64_t climbed = 0;
  walkOnTilesOfTheProduct(walkedClimb(climbed), result);
  EXPECT_GT(result.moved, 200u);
  EXPECT_GT(result.started_long, 0u);
}

TEST(BoundedClimb, LoadingWhatWasAbsentAndRepeatingGivesTheAnswerOfTheWhole) {
  Walked result;
  std::uint64_t climbed = 0;
  walkThroughAbsentTiles(walkedClimb(climbed), 30, {3, 20, kUnbounded}, result);
  EXPECT_GT(result.frontiers, 100u);
}

TEST(BoundedClimb, DistanceNeverRisesAndFallsByMoreThanRoundingWhereTheProxyLeavesItsSegment) {
  std::uint64_t left = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const Vector3d centre_W = seed % 4 == 3 ? Vector3d(-1e9, 1e9, 1e9) : Vector3d::Zero();
    const TestGraph graph = randomGraph(random, 200, seed % 2 == 0, centre_W);
    const WholeGraph whole(graph.segments, graph.grid);
    const TiledGraph tiled(graph, 64);
    const auto solved = climber(seed % 2 == 0 ? 4 : 256);
    SolverStep step;
    for (const Vector3d& h_W : jumpingProbes(whole, random, 10)) {
      const RandomStart start = randomStart(whole, random);
      solved->setPlace(viewOf(tiled, graph).placeAt(tiled.tileOf(start.segment), start.segment, start.t));
      for (int i = 0; i < 40; ++i) {
        const ProxyPlace before = solved->place();
        const double distance = (before.p_W - h_W).norm();
        watchedTick(*solved, viewOf(tiled, graph), {h_W, 1e-3, 2500}, step);
        const double now = (solved->place().p_W - h_W).norm();
        ASSERT_LE(now, distance);
        if (solved->place().segment != before.segment) {
          ++left;
          ASSERT_LT(now, distance - 0.99 * eps(distance));
        } else if (now == distance) {
          ASSERT_TRUE(samePlace(solved->place(), before));
        }
      }
    }
  }
  EXPECT_GT(left, 300u);
}

TEST(BoundedClimb, WithoutABudgetItTakesTheBestOfWhatBasicReaches) {
  std::uint64_t better = 0;
  const ClimbParameters none{.rest_mm = 0, .gain = 0, .patience_1_s = 0};
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const TestGraph graph = randomGraph(random, 150, seed % 2 == 0);
    const WholeGraph whole(graph.segments, graph.grid);
    const TiledGraph tiled(graph, 16);
    const GraphView view = viewOf(tiled, graph);
    const auto solved = climber(kUnbounded, none);
    PaperOracle basic(whole, SolverMethod::basic, {});
    SolverStep step;
    for (const Vector3d& h_W : jumpingProbes(whole, random, 30)) {
      const RandomStart start = randomStart(whole, random);
      solved->setPlace(view.placeAt(tiled.tileOf(start.segment), start.segment, start.t));
      basic.setPlace(solved->place());
      watchedTick(*solved, view, {h_W}, step);
      basic.advance(h_W);
      const double bound = (basic.place().p_W - h_W).norm();
      const double distance = (solved->place().p_W - h_W).norm();
      ASSERT_LE(distance, bound + eps(bound));
      better += distance < bound - 1e-6;
    }
  }
  // At a node, climb also starts from the segment, and from its other end if that is nearer: never worse, rarely
  // better.
  RecordProperty("better", static_cast<int>(better));
}

// A valley at an elbow node: the way out rises by 1.35 mm of the device, over two nodes, and then falls.
struct Elbow {
  TestGraph graph;
  static constexpr double kScale_um_m = 1000;          // 1 um of world is 1 mm of device
  static Vector3d probe_W() { return {0.3, 0.3, 0}; }  // the elbow is a local minimum of its distance

  Elbow() {
    TestGraphBuilder builder;
    std::uint32_t last = builder.node(Vector3d(-3, 3, 0));
    for (const Vector3d& p_W :
         {Vector3d(0, 0, 0), Vector3d(0.5, -0.5, 0), Vector3d(1.0, -0.9, 0), Vector3d(0.2, 0.3, 0)}) {
      const std::uint32_t next = builder.node(p_W);
      builder.link(next, last);
      last = next;
    }
    graph = builder.build();
  }
};

TEST(BoundedClimb, PassesSeveralNodesUphillIfAndOnlyIfTheBudgetAllows) {
  const Elbow elbow;
  const TiledGraph tiled(elbow.graph, 4);
  const GraphView view = viewOf(tiled, elbow.graph);
  const double climb_mm = std::sqrt(0.5) + std::hypot(0.5, 0.4);  // from the elbow to the far corner
  for (const double share : {0.99, 1.01}) {
    const auto solved = climber(256, {.rest_mm = 2 * climb_mm, .gain = 0, .patience_1_s = 0});
    solved->setPlace(view.placeAt(tiled.tileOf({0, 1}), {0, 1}, 0.0));
    SolverStep step;
    watchedTick(*solved, view, {Elbow::probe_W(), 1e-3, Elbow::kScale_um_m, share / 2}, step);
    EXPECT_EQ(solved->place().segment == (SegmentId{0, 4}), share > 1) << solved->place().p_W.transpose();
  }
}

TEST(BoundedClimb, TheBudgetIsOneOfTheDeviceWhateverTheZoom) {
  const Elbow elbow;
  const TiledGraph tiled(elbow.graph, 2048);
  const GraphView view = viewOf(tiled, elbow.graph);
  for (const double zoom : {0.25, 1.0, 4.0}) {  // the budget in the device is the same
    const auto solved = climber(256, {.rest_mm = 1.5, .gain = 0, .patience_1_s = 0});
    solved->setPlace(view.placeAt(0, {0, 1}, 0.0));
    SolverStep step;
    watchedTick(*solved, view, {Elbow::probe_W(), 1e-3, zoom * Elbow::kScale_um_m}, step);
    EXPECT_EQ(solved->place().segment == (SegmentId{0, 4}), zoom >= 1) << zoom;
  }
}

TEST(BoundedClimb, AHandThatKeepsPullingGetsOutAndALooseOneDoesNot) {
  const Elbow elbow;
  const TiledGraph tiled(elbow.graph, 2048);
  const GraphView view = viewOf(tiled, elbow.graph);
  const auto ticksToGetOut = [&](double patience_1_s, double pull_mm) {
    const auto solved =
        climber(256, {.rest_mm = 0, .gain = 0, .patience_1_s = patience_1_s, .pull_mm = pull_mm, .growth_1_mm = 0});
    solved->setPlace(view.placeAt(0, {0, 1}, 0.0));
    SolverStep step;
    for (int i = 0; i < 5000; ++i) {
      watchedTick(*solved, view, {Elbow::probe_W(), 1e-3, Elbow::kScale_um_m}, step);
      if (solved->place().segment == (SegmentId{0, 4})) return i;
    }
    return -1;
  };
  const double counts_mm = std::sqrt(0.18) - 0.2, climb_mm = std::sqrt(0.5) + std::hypot(0.5, 0.4);
  EXPECT_NEAR(ticksToGetOut(10, 0.2), climb_mm / (10 * counts_mm * 1e-3), 2);
  EXPECT_EQ(ticksToGetOut(0, 0.2), -1);
  EXPECT_EQ(ticksToGetOut(10, 0.5), -1);
}

// The patience takes about log(climb) ticks, not as many as the climb is long, and a proxy that follows has none.
TEST(BoundedClimb, PatienceGrowsByAFactorAndMotionTakesIt) {
  TestGraphBuilder builder;
  const std::uint32_t fork = builder.node(Vector3d(0, 0, 0));
  builder.link(builder.node(Vector3d(-20, 0, 0)), fork);
  const std::uint32_t tip[2] = {builder.node(Vector3d(60, 1, 0)), builder.node(Vector3d(60, -1, 0))};
  for (const std::uint32_t one : tip) builder.link(one, fork);
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 2048);
  const GraphView view = viewOf(tiled, graph);
  // The hand is beside the other branch at x mm, and advances by `step_mm` a tick.
  const auto ticksToChange = [&](double step_mm) {
    const auto solved = climber(256);
    solved->setPlace(view.placeAt(0, {0, tip[0]}, 1 - 20.0 / 60));
    SolverStep step;
    double x_mm = 20;
    for (int i = 1; i <= 200; ++i, x_mm += step_mm) {
      watchedTick(*solved, view, {Vector3d(x_mm, -x_mm / 60, 0), 1e-3, 1000}, step);
      if (solved->place().segment == (SegmentId{0, tip[1]})) return i;
    }
    return 201;
  };
  const int held = ticksToChange(0), followed = ticksToChange(0.15);
  EXPECT_LT(held, 100);
  EXPECT_EQ(followed, 201) << "150 mm/s";
}

// Two straight branches of a fork, 0.1 rad apart. The proxy is on one branch; the hand holds still beside it, on the
// other.
TEST(BoundedClimb, LeavesABranchNearlyParallelToTheOneWhereTheHandIs) {
  constexpr double kHalf_rad = 0.05;
  const Vector3d along[2] = {{std::cos(kHalf_rad), std::sin(kHalf_rad), 0},
                             {std::cos(kHalf_rad), -std::sin(kHalf_rad), 0}};
  TestGraphBuilder builder;
  const std::uint32_t fork = builder.node(Vector3d(0, 0, 0));
  builder.link(builder.node(Vector3d(-20, 0, 0)), fork);
  const std::uint32_t tip[2] = {builder.node(40 * along[0]), builder.node(40 * along[1])};
  for (const std::uint32_t one : tip) builder.link(one, fork);
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 2048);
  const GraphView view = viewOf(tiled, graph);
  const auto ticksToChange = [&](double past_fork_mm) {
    const auto solved = climber(256);
    solved->setPlace(view.placeAt(0, {0, tip[0]}, 1 - past_fork_mm / 40));
    SolverStep step;
    for (int i = 1; i <= 3000; ++i) {
      watchedTick(*solved, view, {past_fork_mm * along[1], 1e-3, 1000}, step);  // 1 um is 1 mm of the device
      if (solved->place().segment == (SegmentId{0, tip[1]})) return i;
    }
    return 3001;
  };
  EXPECT_EQ(ticksToChange(2), 1);  // still near the fork
  EXPECT_LE(ticksToChange(35), 500);
}

// Without undo: as in real time, ticks continue while tiles are loaded.
TEST(BoundedClimb, AtAFrontierItStaysOnTheStructureAndGoesOnWhenTheTileComes) {
  std::mt19937_64 random(4);
  const TestGraph graph = randomGraph(random, 300, false);
  const WholeGraph whole(graph.segments, graph.grid);
  TiledGraph tiled(graph, 8);
  const GraphView view = viewOf(tiled, graph);
  std::uint64_t frontiers = 0;
  for (int round = 0; round < 20; ++round) {
    const RandomStart start = randomStart(whole, random);
    const auto solved = climber(kUnbounded);
    solved->setPlace(view.placeAt(tiled.tileOf(start.segment), start.segment, start.t));
    tiled.dropAll();
    const ProbeState probe{graph.grid.toWorld(graph.segments[random() % graph.segments.size()].child), 1e-3, 8000};
    SolverStep step;
    double distance = (solved->place().p_W - probe.h_W).norm();
    for (int i = 0; i < 400; ++i) {
      watchedTick(*solved, view, probe, step);
      frontiers += step.frontiers;
      const double now = (solved->place().p_W - probe.h_W).norm();
      ASSERT_LE(now, distance);
      distance = now;
      if (i % 5 == 4)
        for (std::uint32_t t = 0; t < step.absent.count; ++t) tiled.load(step.absent.ids[t]);
    }
    ASSERT_EQ(step.frontiers, 0u);
    for (TileId id = 0; id < tiled.tile_count(); ++id) tiled.load(id);
  }
  EXPECT_GT(frontiers, 200u);
}

TEST(BoundedClimb, EveryBranchOfAHubIsSeenWithinFourTimesDegreeOverTheCap) {
  constexpr std::uint32_t kBranches = 10000;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const std::uint32_t best : {1u, 254u, 255u, 256u, 5000u, kBranches}) {
    TestGraphBuilder builder;
    const std::uint32_t hub = builder.node(Vector3d(0, 0, 0));
    for (std::uint32_t i = 1; i <= kBranches; ++i) {
      const double y = unit(random), z = unit(random);
      builder.link(builder.node(i == best ? Vector3d(5, 0.1, 0) : Vector3d(-1 - y * y, y, z)), hub);
    }
    const TestGraph graph = builder.build();
    const TiledGraph tiled(graph, 100000);
    const GraphView view = viewOf(tiled, graph);
    const auto solved = climber(256);
    // Starts on a branch that points away, with a hand that never rests.
    const SegmentId start{0, best == 7000 ? 7001u : 7000u};
    solved->setPlace(view.placeAt(0, start, 0.5));
    SolverStep step;
    int ticks = 0;
    while (solved->place().segment != SegmentId{0, best}) {
      watchedTick(*solved, view, {Vector3d(4, 1e-3 * ticks, 0), 1e-3, 2500}, step);
      ASSERT_LE(step.visited, 256u);
      ASSERT_LE(++ticks, 160) << best;
    }
  }
}

// 20 000 straight branches: all are looked at within 20 000 / (2 x 2048) looks, in every second tick. The rest lets the
// proxy come back from others that it goes down before.
TEST(BoundedClimb, AtAHubTheBranchThatPointsToTheHandIsFoundInTenTicks) {
  constexpr std::uint32_t kBranches = 20000;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  TestGraphBuilder builder;
  const std::uint32_t hub = builder.node(Vector3d(0, 0, 0));
  std::vector<Vector3d> directions;
  std::vector<std::uint32_t> tips;
  for (std::uint32_t i = 0; i < kBranches; ++i) {
    directions.push_back(Vector3d(normal(random), normal(random), normal(random)).normalized());
    tips.push_back(builder.node(40 * directions.back()));
    builder.link(tips.back(), hub);
  }
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 100000);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = climber(2048, {.rest_mm = 60});
  for (const std::size_t wanted : {0u, 7000u, kBranches - 1}) {
    solved->setPlace(view.placeAt(0, {0, tips[(wanted + 100) % kBranches]}, 0.99));  // 0.4 um from the hub
    SolverStep step;
    int ticks = 0;
    while (solved->place().segment != SegmentId{0, tips[wanted]}) {
      watchedTick(*solved, view, {30 * directions[wanted], 1e-3, 1000}, step);
      ASSERT_LE(step.visited, 2048u);
      ASSERT_LE(++ticks, 10) << wanted;
    }
    solved->undo();
    EXPECT_NE(solved->place().segment, (SegmentId{0, tips[wanted]}));
    watchedTick(*solved, view, {30 * directions[wanted], 1e-3, 1000}, step);
    EXPECT_EQ(solved->place().segment, (SegmentId{0, tips[wanted]})) << "undo restores what was looked at";
  }
}

// At a coarse zoom, thousands of twigs lie within the budget.
TEST(BoundedClimb, WorkIsBoundedOnACombAndOnALongNeurite) {
  for (const bool is_comb : {true, false}) {
    CellList stream({is_comb ? comb(20000) : longNeurite(40000, 0.5)});
    const auto store = buildTilesInMemory(stream);
    std::vector<std::shared_ptr<const Tile>> tiles;
    TileTable table(store->tile_count());
    for (TileId id = 0; id < store->tile_count(); ++id) {
      tiles.push_back(store->load(id));
      table.add(*tiles.back());
    }
    const GraphView view(table, store->leaves(), store->grid());
    const auto solved = climber();
    const Tile& middle = *tiles[tiles.size() / 2];
    solved->setPlace(view.placeAt(middle.id(), middle.segmentId(middle.segment_count() / 2), 0.5));
    SolverStep step;
    int capped = 0;
    for (int i = 0; i < 500; ++i) {
      const Vector3d h_W = solved->place().p_W + Vector3d(i % 50 == 0 ? 1e5 : 3.0, 2, 0);
      const double distance = (solved->place().p_W - h_W).norm();
      watchedTick(*solved, view, {h_W, 1e-3, 1e6 / 0.12}, step);
      ASSERT_LE(step.visited, 256u);
      ASSERT_LE((solved->place().p_W - h_W).norm(), distance);
      capped += step.capped;
    }
    EXPECT_GT(capped, 400) << (is_comb ? "comb" : "neurite");
  }
}

TEST(BoundedClimb, RoundingIsNoProgress) {
  // Two neurites at the same distance; one is nearer by less than eps. The proxy stays where it is.
  TestGraphBuilder builder(Grid(-10));
  const Vector3d far_W(1e9, 1e9, 1e9);
  const std::uint32_t root = builder.node(far_W);
  const std::uint32_t up = builder.node(far_W + Vector3d(0, 1, 0)), down = builder.node(far_W + Vector3d(0, -1, 0));
  builder.link(up, root);
  builder.link(down, root);
  builder.link(builder.node(far_W + Vector3d(4, 1, 0)), up);
  builder.link(builder.node(far_W + Vector3d(4, -1, 0)), down);
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 2048);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = climber();
  solved->setPlace(view.placeAt(0, {0, 3}, 0.5));
  SolverStep step;
  watchedTick(*solved, view, {far_W + Vector3d(2, 0, 0), 1e-3, 1000}, step);  // exactly in the middle
  EXPECT_EQ(solved->place().segment, (SegmentId{0, 3}));
  EXPECT_GT(step.visited, 3u);  // it saw the other
  // At a distance of 1e9 um, a step of 0.1 nm is less than 1e-12 of the distance.
  watchedTick(*solved, view, {far_W + Vector3d(2, 0, 1e9), 1e-3, 1000}, step);
  EXPECT_EQ(solved->place().segment, (SegmentId{0, 3}));
  watchedTick(*solved, view, {far_W + Vector3d(2, -1e-4, 1e9), 1e-3, 1000}, step);
  EXPECT_EQ(solved->place().segment, (SegmentId{0, 3}));
  EXPECT_GT(step.visited, 3u);  // it saw the other
}

TEST(BoundedClimb, WithoutAScaleThereIsNoBudgetAndWithoutTimeNoPatience) {
  std::mt19937_64 random(6);
  const TestGraph graph = randomGraph(random, 100, true);
  const TiledGraph tiled(graph, 16);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = climber();
  SolverStep step;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf, 0.0, -1.0, 1e300, 1e-300}) {
    solved->setPlace(view.placeAt(0, tiled.tile(0).segmentId(0), 0.5));
    watchedTick(*solved, view, {Vector3d(1, 2, 3), 1e-3, bad}, step);
    EXPECT_TRUE(solved->place().p_W.allFinite());
    watchedTick(*solved, view, {Vector3d(1, 2, 3), bad, 2500}, step);
    EXPECT_TRUE(solved->place().p_W.allFinite());
    EXPECT_LE(step.visited, 256u);
  }
}

}  // namespace
}  // namespace filiform::test
