// The common engine of the basic and the force-based solver: equality with the literal oracle, tilings, frontiers,
// bounds, undo. BoundedMethods tests BoundedClimb, too.
#include "solver/proxy/internal/bounded_search.h"

#include "tests/support/no_alloc_guard.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/oracle_walk.h"
#include "tests/support/scenes/paper_oracle.h"
#include "tests/support/scenes/proxy_walk.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/store_graph.h"
#include "tests/support/scenes/test_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

class SearchOracle final : public Oracle {
 public:
  SearchOracle(const WholeGraph& whole, SolverMethod method) : oracle_(whole, method, livelyParameters(kUnbounded)) {}
  ProxyPlace place() const override { return oracle_.place(); }
  void setPlace(const ProxyPlace& place) override { oracle_.setPlace(place); }
  std::uint32_t advance(const ProbeState& probe) override { return oracle_.advance(probe.h_W); }

 private:
  PaperOracle oracle_;
};

class BoundedMethods : public testing::TestWithParam<SolverMethod> {
 protected:
  static void tick(ProxySolver& solver, const GraphView& view, const Vector3d& h_W, SolverStep& step) {
    watchedTick(solver, view, {h_W}, step);
  }
  static void takeBack(ProxySolver& solver) { watchedUndo(solver); }
  std::unique_ptr<ProxySolver> solver(std::uint32_t max_visited) const {
    return makeProxySolver(GetParam(), livelyParameters(max_visited));
  }
};

class BoundedSearch : public BoundedMethods {
 protected:
  WalkedMethod walked() const {
    return {[this](std::uint64_t, std::uint32_t max_visited) { return solver(max_visited); },
            [](std::uint64_t, const WholeGraph& whole) { return std::make_unique<SearchOracle>(whole, GetParam()); },
            [](const WholeGraph& whole, std::mt19937_64& random) {
              std::vector<ProbeState> probes;
              for (const Vector3d& h_W : smoothProbes(whole, random, 60)) probes.push_back({h_W});
              for (const Vector3d& h_W : jumpingProbes(whole, random, 20)) probes.push_back({h_W});
              return probes;
            },
            kUnbounded};
  }
};

std::string nameOf(const testing::TestParamInfo<SolverMethod>& method) {
  std::string name = toString(method.param);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Methods, BoundedSearch,
                         testing::Values(SolverMethod::basic, SolverMethod::force, SolverMethod::force_listing),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(Methods, BoundedMethods,
                         testing::Values(SolverMethod::basic, SolverMethod::force, SolverMethod::force_listing,
                                         SolverMethod::climb),
                         nameOf);

TEST_P(BoundedSearch, EqualsTheLiteralOracleInEveryTiling) {
  Walked result;
  walkInEveryTiling(walked(), sampled(240), result);
  EXPECT_GT(result.moved, sampled(5000));
  EXPECT_GT(result.farthest, 20u);
}

TEST_P(BoundedSearch, EqualsTheLiteralOracleOnTheTilesOfTheProduct) {
  Walked result;
  walkOnTilesOfTheProduct(walked(), result);
  EXPECT_GT(result.moved, 200u);
  EXPECT_GT(result.started_long, 0u);
}

TEST_P(BoundedSearch, LoadingWhatWasAbsentAndRepeatingGivesTheAnswerOfTheWhole) {
  Walked result;  // with small caps, unfinished sweeps must survive changes of the tiles
  walkThroughAbsentTiles(walked(), sampled(36), {3, 20, kUnbounded}, result);
  EXPECT_GT(result.frontiers, sampled(100));
}

TEST_P(BoundedMethods, ATileIsReportedAbsentIfAndOnlyIfItWouldHaveBeenRead) {
  for (std::uint64_t seed = 0; seed < sampled(20); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const TestGraph graph = randomGraph(random, 120, seed % 2 == 0);
    const WholeGraph whole(graph.segments, graph.grid);
    TiledGraph tiled(graph, 8);
    const auto solved = solver(seed % 2 == 0 ? 5 : kUnbounded);
    const RandomStart start = randomStart(whole, random);
    solved->setPlace(viewOf(tiled, graph).placeAt(tiled.tileOf(start.segment), start.segment, start.t));
    SolverStep step, again;
    for (const Vector3d& h_W : jumpingProbes(whole, random, 25)) {
      for (TileId id = 0; id < tiled.tile_count(); ++id) tiled.load(id);
      tick(*solved, viewOf(tiled, graph), h_W, step);
      const ProxyPlace place = solved->place();
      const auto onlyTouched = [&] {
        tiled.dropAll();
        for (std::uint32_t i = 0; i < step.touched.count; ++i) tiled.load(step.touched.ids[i]);
      };
      for (std::uint32_t i = 0; i < step.touched.count; ++i) {
        takeBack(*solved);
        onlyTouched();
        tiled.drop(step.touched.ids[i]);
        tick(*solved, viewOf(tiled, graph), h_W, again);
        // More tiles may follow, because the search uses the saved work elsewhere. But the first tile is the missing
        // one.
        ASSERT_GE(again.absent.count, 1u);
        ASSERT_EQ(again.absent.ids[0], step.touched.ids[i]);
      }
      takeBack(*solved);
      onlyTouched();
      tick(*solved, viewOf(tiled, graph), h_W, again);
      ASSERT_EQ(again.absent.count, 0u);
      ASSERT_TRUE(samePlace(solved->place(), place));
      ASSERT_EQ(solved->place().tile, place.tile);
    }
  }
}

TEST_P(BoundedMethods, UndoneTicksLeaveNoTrace) {
  for (std::uint64_t seed = 0; seed < sampled(42); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const TestGraph graph = randomGraph(random, 200, seed % 2 == 0);
    const WholeGraph whole(graph.segments, graph.grid);
    const TiledGraph tiled(graph, 32);
    const GraphView view = viewOf(tiled, graph);
    const std::uint32_t caps[] = {1, 2, 3, 5, 9, kUnbounded};
    const auto plain = solver(caps[seed % 6]), hesitant = solver(caps[seed % 6]);
    const RandomStart start = randomStart(whole, random);
    plain->setPlace(view.placeAt(tiled.tileOf(start.segment), start.segment, start.t));
    hesitant->setPlace(plain->place());

    const std::vector<Vector3d> probes = jumpingProbes(whole, random, 200);
    SolverStep expected, step;
    for (std::size_t i = 0; i < probes.size(); ++i) {
      // Some probes stay at rest, so that sweeps end in later ticks too.
      const Vector3d& h_W = probes[random() % 4 == 0 ? i : i - i % 10];
      tick(*plain, view, h_W, expected);
      for (std::uint64_t undone = random() % 3; undone > 0; --undone) {
        tick(*hesitant, view, random() % 4 == 0 ? h_W : probes[random() % probes.size()], step);
        takeBack(*hesitant);
      }
      tick(*hesitant, view, h_W, step);
      ASSERT_TRUE(samePlace(hesitant->place(), plain->place()));
      ASSERT_EQ(hesitant->place().tile, plain->place().tile);
      ASSERT_EQ(step.visited, expected.visited);
      ASSERT_EQ(step.capped, expected.capped);
      ASSERT_EQ(step.touched.count, expected.touched.count);
    }
  }
}

TEST_P(BoundedSearch, CappedSweepEndsWithTheOraclesAnswerWhileTheProbeIsHeld) {
  std::uint64_t capped = 0;
  for (std::uint64_t seed = 0; seed < sampled(60); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const TestGraph graph = randomGraph(random, 150, seed % 2 == 0);
    const WholeGraph whole(graph.segments, graph.grid);
    const TiledGraph tiled(graph, 16);
    const std::uint32_t cap = 1 + static_cast<std::uint32_t>(seed % 7);
    const auto bounded = solver(cap);
    PaperOracle oracle(whole, GetParam(), livelyParameters(kUnbounded));
    for (const Vector3d& h_W : jumpingProbes(whole, random, 20)) {
      const RandomStart start = randomStart(whole, random);
      bounded->setPlace(viewOf(tiled, graph).placeAt(tiled.tileOf(start.segment), start.segment, start.t));
      oracle.setPlace(bounded->place());
      const std::uint32_t needed = oracle.advance(h_W);
      SolverStep step;
      std::uint32_t visited = 0;
      double distance = (bounded->place().p_W - h_W).squaredNorm();
      do {
        tick(*bounded, viewOf(tiled, graph), h_W, step);
        ASSERT_LE(step.visited, cap);
        visited += step.visited;
        capped += step.capped;
        ASSERT_LE(visited, needed);
        const double now = (bounded->place().p_W - h_W).squaredNorm();
        ASSERT_LE(now, distance);
        distance = now;
      } while (step.capped);
      ASSERT_EQ(visited, needed);
      ASSERT_TRUE(samePlace(bounded->place(), oracle.place()));
    }
  }
  EXPECT_GT(capped, sampled(1000));
}

TEST_P(BoundedSearch, DistanceNeverRisesAtAFixedProbe) {
  for (std::uint64_t seed = 0; seed < sampled(40); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const TestGraph graph = randomGraph(random, 200, seed % 2 == 0);
    const WholeGraph whole(graph.segments, graph.grid);
    const TiledGraph tiled(graph, 64);
    const GraphView view = viewOf(tiled, graph);
    const auto solved = solver(seed % 2 == 0 ? 4 : 256);
    SolverStep step;
    for (const Vector3d& h_W : jumpingProbes(whole, random, 10)) {
      const RandomStart start = randomStart(whole, random);
      solved->setPlace(view.placeAt(tiled.tileOf(start.segment), start.segment, start.t));
      // A sweep of the last probe may be unfinished when this one begins.
      tick(*solved, view, jumpingProbes(whole, random, 1)[0], step);
      double distance = (solved->place().p_W - h_W).squaredNorm();
      for (int i = 0; i < 60; ++i) {
        const ProxyPlace before = solved->place();
        tick(*solved, view, h_W, step);
        const double now = (solved->place().p_W - h_W).squaredNorm();
        ASSERT_LE(now, distance);
        if (now == distance) {
          ASSERT_TRUE(samePlace(solved->place(), before));
        }
        distance = now;
      }
    }
  }
}

// A hub; all branches except the last one in order point away from the probe.
struct Hub {
  static constexpr std::uint32_t kBranches = 10000;
  TestGraph graph;
  SegmentId best;

  explicit Hub(std::uint32_t branches = kBranches) {
    TestGraphBuilder builder;
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const std::uint32_t hub = builder.node(Vector3d(0, 0, 0));
    for (std::uint32_t i = 0; i < branches; ++i) {
      const bool last = i + 1 == branches;
      const double y = unit(random), z = unit(random);
      builder.link(builder.node(last ? Vector3d(5, 0.1, 0) : Vector3d(-1 - y * y, y, z)), hub);
    }
    graph = builder.build();
    best = graph.segments.back().id;
  }
};

TEST_P(BoundedSearch, HubOfTenThousandBranchesIsSeenWholeInBoundedTicks) {
  const Hub hub;
  const TiledGraph tiled(hub.graph, 2048);
  const GraphView view = viewOf(tiled, hub.graph);
  const WholeGraph whole(hub.graph.segments, hub.graph.grid);
  const auto solved = solver(256);
  solved->setPlace(view.placeAt(tiled.tileOf({0, 1}), {0, 1}, 1.0));
  ASSERT_TRUE(solved->place().at_node);
  PaperOracle oracle(whole, GetParam(), livelyParameters(kUnbounded));
  oracle.setPlace(solved->place());
  const Vector3d h_W(4, 0, 0);
  oracle.advance(h_W);
  SolverStep step;
  int ticks = 0;
  do {
    tick(*solved, view, h_W, step);
    ASSERT_LE(step.visited, 256u);
    ASSERT_LE(++ticks, 41);
  } while (step.capped);
  EXPECT_EQ(ticks, 40);
  EXPECT_TRUE(samePlace(solved->place(), oracle.place()));
  EXPECT_EQ(solved->place().segment, hub.best);
}

TEST_P(BoundedSearch, HubIsSeenWholeUnderAHandThatNeverRests) {
  const Hub hub;
  const TiledGraph tiled(hub.graph, 2048);
  const GraphView view = viewOf(tiled, hub.graph);
  const auto solved = solver(256);
  // Starts on a branch that points away, so that the first tick pulls the proxy to the hub.
  solved->setPlace(view.placeAt(tiled.tileOf({0, 1}), {0, 1}, 0.5));
  SolverStep step;
  int ticks = 0;
  while (solved->place().segment != hub.best) {
    tick(*solved, view, Vector3d(4, 1e-3 * ticks, 0), step);
    ASSERT_LE(step.visited, 256u);
    ASSERT_LE(++ticks, 42);
  }
}

TEST_P(BoundedSearch, ASingleTestATickStillEndsTheSweepUnderAHandThatNeverRests) {
  const Hub hub(50);
  const TiledGraph tiled(hub.graph, 2048);
  const GraphView view = viewOf(tiled, hub.graph);
  const auto solved = solver(1);
  solved->setPlace(view.placeAt(0, {0, 1}, 1.0));
  SolverStep step;
  int ticks = 0;
  while (solved->place().segment != hub.best) {
    tick(*solved, view, Vector3d(4, 1e-3 * ticks, 0), step);
    ASSERT_LE(step.visited, 1u);
    ASSERT_LE(++ticks, 60);
  }
}

TEST_P(BoundedSearch, ANewSweepFollowsInTheTickThatEndsTheSweepOfAnotherProbe) {
  const Hub hub(100);
  const TiledGraph tiled(hub.graph, 2048);
  const GraphView view = viewOf(tiled, hub.graph);
  const auto solved = solver(64), held = solver(64);
  solved->setPlace(view.placeAt(0, {0, 1}, 1.0));
  held->setPlace(solved->place());
  SolverStep step;
  tick(*solved, view, Vector3d(4, 0, 0), step);
  ASSERT_TRUE(step.capped);
  tick(*held, view, Vector3d(4, 0, 0), step);
  tick(*held, view, Vector3d(4, 0, 0), step);
  EXPECT_EQ(step.visited, 36u);  // only the rest: the probe has not moved
  // The active segment, the rest of the old sweep, and then a new sweep up to the cap.
  tick(*solved, view, Vector3d(4, 0.01, 0), step);
  EXPECT_GT(step.visited, 37u);
  EXPECT_EQ(solved->place().segment, hub.best);
}

TEST_P(BoundedSearch, ProxySlidesAlongItsSegmentWhileASweepIsUnfinished) {
  // A hub at one end of the active segment keeps the sweep unfinished. Meanwhile the hand moves along the segment.
  TestGraphBuilder builder;
  const std::uint32_t hub = builder.node(Vector3d(0, 0, 0));
  builder.link(builder.node(Vector3d(10, 0, 0)), hub);
  for (int i = 0; i < 5000; ++i) builder.link(builder.node(Vector3d(-1, 4e-4 * i - 1, 0)), hub);
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 100000);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = solver(64);
  solved->setPlace(view.placeAt(0, {0, 1}, 0.9));
  SolverStep step;
  tick(*solved, view, Vector3d(0, 0, 0.5), step);  // to the hub, where all branches are tested
  ASSERT_TRUE(step.capped);
  for (int i = 0; i < 30; ++i) {
    const Vector3d h_W(1.0 + 0.1 * i, 0.2, 0);
    tick(*solved, view, h_W, step);
    ASSERT_TRUE(step.capped);
    ASSERT_EQ(solved->place().segment, (SegmentId{0, 1}));
    ASSERT_NEAR(solved->place().p_W.x(), h_W.x(), 1e-12);
  }
}

// A hub whose branches all lead to the probe, each a little nearer, so that all far ends are entered.
TEST_P(BoundedSearch, FullLabelsEndTheSweepAndAreReported) {
  constexpr std::uint32_t kBranches = internal::BoundedSearch::kLeastLabels + 100;
  TestGraphBuilder builder;
  const std::uint32_t hub = builder.node(Vector3d(0, 0, 0));
  for (std::uint32_t i = 0; i < kBranches; ++i) builder.link(builder.node(Vector3d(1 + 4e-3 * i, 0, 0)), hub);
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 100000);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = solver(256), hesitant = solver(256);
  solved->setPlace(view.placeAt(0, {0, 1}, 1.0));
  hesitant->setPlace(solved->place());
  const Vector3d h_W(1000, 0, 0);
  SolverStep step, again;
  std::uint64_t visited = 0;
  do {
    tick(*solved, view, h_W, step);
    tick(*hesitant, view, h_W, again);
    takeBack(*hesitant);
    tick(*hesitant, view, h_W, again);
    ASSERT_LE(step.visited, 256u);
    ASSERT_EQ(step.visited, again.visited);
    ASSERT_TRUE(samePlace(solved->place(), hesitant->place()));
    visited += step.visited;
    ASSERT_LE(visited, kBranches);
  } while (step.capped);
  EXPECT_GE(visited, internal::BoundedSearch::kLeastLabels - 2);
  EXPECT_LT(visited, kBranches);
}

TEST_P(BoundedMethods, ProbeThatIsNotFiniteChangesNothing) {
  std::mt19937_64 random(5);
  const TestGraph graph = randomGraph(random, 200, true);
  const WholeGraph whole(graph.segments, graph.grid);
  const TiledGraph tiled(graph, 16);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = solver(3), undisturbed = solver(3);
  solved->setPlace(view.placeAt(tiled.tileOf(whole.segments()[0].id), whole.segments()[0].id, 0.5));
  undisturbed->setPlace(solved->place());
  constexpr double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  const Vector3d bad[] = {{nan, 0, 0}, {0, inf, 0}, {0, 0, -inf}, {1e200, 0, 0}};
  SolverStep step;
  for (const Vector3d& h_W : jumpingProbes(whole, random, 50)) {
    for (const Vector3d& none_W : bad) {
      const ProxyPlace before = solved->place();
      tick(*solved, view, none_W, step);
      ASSERT_EQ(step.visited, 0u);
      ASSERT_FALSE(step.capped);
      ASSERT_TRUE(samePlace(solved->place(), before));
      if (none_W.x() == 0) takeBack(*solved);
      ASSERT_TRUE(samePlace(solved->place(), before));
    }
    tick(*solved, view, h_W, step);
    tick(*undisturbed, view, h_W, step);
    ASSERT_TRUE(samePlace(solved->place(), undisturbed->place()));
  }
}

TEST_P(BoundedMethods, ProbeThatJumpsByMetresStaysWithinTheBounds) {
  std::mt19937_64 random(6);
  TestGraphBuilder builder;  // a long neurite with twigs
  std::uint32_t last = builder.node(Vector3d(0, 0, 0));
  for (int i = 1; i < 20000; ++i) {
    const std::uint32_t next = builder.node(Vector3d(i, std::sin(0.1 * i), 0));
    builder.link(next, last);
    if (i % 5 == 0) builder.link(builder.node(Vector3d(i, 2, 1)), next);
    last = next;
  }
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 2048);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = solver(256);
  solved->setPlace(view.placeAt(tiled.tileOf({0, 5000}), {0, 5000}, 0.5));
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  SolverStep step;
  for (int i = 0; i < 2000; ++i) {
    const double far[] = {1e6, 1e9, 1e12, 1e150};
    tick(*solved, view, far[i % 4] * Vector3d(unit(random), unit(random), unit(random)), step);
    ASSERT_LE(step.visited, 256u);
    ASSERT_TRUE(solved->place().p_W.allFinite());
    ASSERT_TRUE(solved->place().t >= 0 && solved->place().t <= 1);
  }
  // With the probe at rest, the sweep ends.
  for (int i = 0; i < 1000; ++i) tick(*solved, view, Vector3d(12345, 0, 0), step);
  EXPECT_LT((solved->place().p_W - Vector3d(12345, 0, 0)).norm(), 2.0);
}

TEST_P(BoundedSearch, AllSegmentsEquidistantKeepsTheProxyStill) {
  TestGraphBuilder builder;  // a cube about the origin: twelve edges, all at the same distance
  for (int i = 0; i < 8; ++i) builder.node(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  for (std::uint32_t a = 0; a < 8; ++a)
    for (const std::uint32_t bit : {1u, 2u, 4u})
      if ((a & bit) == 0) builder.loop(a, a | bit);
  const TestGraph graph = builder.build();
  const WholeGraph whole(graph.segments, graph.grid);
  const TiledGraph tiled(graph, 4);
  const GraphView view = viewOf(tiled, graph);
  for (const WholeGraph::Segment& s : whole.segments()) {
    for (const double t : {0.0, 0.5, 0.7}) {
      const auto solved = solver(256);
      solved->setPlace(view.placeAt(tiled.tileOf(s.id), s.id, t));
      PaperOracle oracle(whole, GetParam(), livelyParameters(256));
      oracle.setPlace(solved->place());
      SolverStep step;
      for (int i = 0; i < 3; ++i) {
        tick(*solved, view, Vector3d::Zero(), step);
        oracle.advance(Vector3d::Zero());
        ASSERT_TRUE(samePlace(solved->place(), oracle.place()));
      }
      EXPECT_DOUBLE_EQ(solved->place().p_W.norm(), std::sqrt(2.0));
    }
  }
}

TEST_P(BoundedSearch, SetPlaceForgetsAnUnfinishedSweep) {
  const Hub hub(3000);
  const TiledGraph tiled(hub.graph, 2048);
  const GraphView view = viewOf(tiled, hub.graph);
  const auto solved = solver(100), fresh = solver(100);
  const ProxyPlace start = view.placeAt(tiled.tileOf({0, 1}), {0, 1}, 1.0);
  SolverStep step, expected;
  solved->setPlace(start);
  for (int i = 0; i < 20; ++i) tick(*solved, view, Vector3d(4, 0, 0), step);
  ASSERT_TRUE(step.capped);
  solved->setPlace(start);
  fresh->setPlace(start);
  for (int i = 0; i < 31; ++i) {
    tick(*solved, view, Vector3d(4, 0, 0), step);
    tick(*fresh, view, Vector3d(4, 0, 0), expected);
    ASSERT_TRUE(samePlace(solved->place(), fresh->place()));
    ASSERT_EQ(step.capped, expected.capped);
  }
}

TEST_P(BoundedMethods, AnInvalidPlaceIsLeftAlone) {
  std::mt19937_64 random(8);
  const TestGraph graph = randomGraph(random, 50, false);
  const TiledGraph tiled(graph, 16);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = solver(256);
  SolverStep step;
  tick(*solved, view, Vector3d::Zero(), step);  // never placed
  EXPECT_FALSE(solved->place().valid());
  EXPECT_EQ(step.visited, 0u);
  ProxyPlace unknown;
  unknown.tile = 0;
  unknown.segment = {99, 99};
  solved->setPlace(unknown);
  tick(*solved, view, Vector3d::Zero(), step);
  EXPECT_TRUE(samePlace(solved->place(), unknown));
  EXPECT_EQ(step.visited, 0u);
  EXPECT_EQ(step.absent.count, 0u);
}

TEST_P(BoundedMethods, TicksMakeNoSystemCall) {
  std::mt19937_64 random(9);
  const TestGraph graph = randomGraph(random, 400, true);
  const WholeGraph whole(graph.segments, graph.grid);
  TiledGraph tiled(graph, 16);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = solver(7);
  const RandomStart start = randomStart(whole, random);
  const ProxyPlace place = view.placeAt(tiled.tileOf(start.segment), start.segment, start.t);
  const std::vector<Vector3d> probes = jumpingProbes(whole, random, 2000);
  SolverStep step;
  const auto walk = [&] {
    solved->setPlace(place);
    std::uint32_t visited = 0;
    for (std::size_t i = 0; i < probes.size(); ++i) {
      const auto other = static_cast<TileId>(i % tiled.tile_count());
      tiled.drop(other);
      solved->advance(view, {probes[i]}, step);
      if (step.absent.count > 0) solved->undo();
      tiled.load(other);
      visited += step.visited;
    }
    return visited > probes.size();
  };
  const SealedRun run = runSealed([&] { walk(); }, walk);
  if (run.outcome == SealedRun::Outcome::refused) {
    if (NoAllocGuard::sees().system_calls) GTEST_SKIP() << run.text;  // this kernel
    ASSERT_TRUE(walk());
    return;
  }
  EXPECT_EQ(run.outcome, SealedRun::Outcome::clean) << run.text;
}

}  // namespace
}  // namespace filiform::test
