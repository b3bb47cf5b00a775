#include "solver/proxy/force_shading.h"

#include "tests/support/scenes/oracle_walk.h"
#include "tests/support/scenes/proxy_walk.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/shading_oracle.h"
#include "tests/support/scenes/store_graph.h"
#include "tests/support/scenes/test_graph.h"

#include <cmath>
#include <limits>
#include <memory>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

std::unique_ptr<ProxySolver> shading(std::uint32_t max_visited = 100000) {
  SolverParameters parameters;
  parameters.max_visited = max_visited;
  return makeProxySolver(SolverMethod::shading, parameters);
}

void tick(ProxySolver& solver, const GraphView& view, const Vector3d& h_W, SolverStep& step) {
  watchedTick(solver, view, {h_W}, step);
}

class WalkedShadingOracle final : public Oracle {
 public:
  explicit WalkedShadingOracle(const WholeGraph& whole) : oracle_(whole) {}
  ProxyPlace place() const override { return oracle_.place(); }
  void setPlace(const ProxyPlace& place) override { oracle_.setPlace(place); }
  std::uint32_t advance(const ProbeState& probe) override { return oracle_.advance(probe.h_W); }

 private:
  ShadingOracle oracle_;
};

WalkedMethod walkedShading() {
  return {[](std::uint64_t, std::uint32_t max_visited) { return shading(max_visited); },
          [](std::uint64_t, const WholeGraph& whole) { return std::make_unique<WalkedShadingOracle>(whole); },
          [](const WholeGraph& whole, std::mt19937_64& random) {
            std::vector<ProbeState> probes;
            for (const Vector3d& h_W : smoothProbes(whole, random, 60)) probes.push_back({h_W});
            for (const Vector3d& h_W : jumpingProbes(whole, random, 20)) probes.push_back({h_W});
            return probes;
          },
          100000};
}

TEST(ForceShading, EqualsTheLiteralOracleInEveryTiling) {
  Walked result;
  walkInEveryTiling(walkedShading(), 160, result);
  EXPECT_GT(result.moved, 4000u);
  EXPECT_GT(result.farthest, 10u);
}

TEST(ForceShading, EqualsTheLiteralOracleOnTheTilesOfTheProduct) {
  Walked result;
  walkOnTilesOfTheProduct(walkedShading(), result);
  EXPECT_GT(result.moved, 100u);
  EXPECT_GT(result.started_long, 0u);
}

TEST(ForceShading, LoadingWhatWasAbsentAndRepeatingGivesTheAnswerOfTheWhole) {
  Walked result;
  walkThroughAbsentTiles(walkedShading(), 24, {5, 100000}, result);
  EXPECT_GT(result.frontiers, 100u);
}

TEST(ForceShading, TurnsEvenlyWhereTheClosestPointWouldStopAtACorner) {
  // Two segments at a right angle. The hand passes the corner on the outside, and the proxy turns around it.
  TestGraphBuilder builder;
  const std::uint32_t root = builder.node(Vector3d(-4, 0, 0)), corner = builder.node(Vector3d(0, 0, 0));
  builder.link(corner, root);
  builder.link(builder.node(Vector3d(0, -4, 0)), corner);
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 2048);
  const GraphView view = viewOf(tiled, graph);
  const auto solved = shading(), basic = makeProxySolver(SolverMethod::basic, {});
  SolverStep step;
  const auto ticksAtCorner = [&](ProxySolver& solver) {
    solver.setPlace(view.placeAt(0, {0, 1}, 0.5));
    int at_corner = 0;
    for (int i = 0; i <= 90; ++i) {
      const double angle = (90 - i) * 3.14159265358979 / 180;
      tick(solver, view, 2 * Vector3d(std::cos(angle), std::sin(angle), 0), step);
      at_corner += solver.place().at_node;
    }
    return at_corner;
  };
  EXPECT_GT(ticksAtCorner(*basic), 80);
  EXPECT_LT(ticksAtCorner(*solved), 3);
}

TEST(ForceShading, ABranchTakesTheDirectionOfTheTwoNearest) {
  // A fork; the hand is beyond the fork, on the side of the second branch.
  TestGraphBuilder builder;
  const std::uint32_t root = builder.node(Vector3d(-4, 0, 0)), fork = builder.node(Vector3d(0, 0, 0));
  builder.link(fork, root);
  builder.link(builder.node(Vector3d(4, 2, 0)), fork);
  builder.link(builder.node(Vector3d(4, -1, 0)), fork);
  builder.link(builder.node(Vector3d(0, 0, 9)), fork);
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 2048);
  const auto solved = shading();
  solved->setPlace(viewOf(tiled, graph).placeAt(0, {0, 1}, 0.5));
  SolverStep step;
  tick(*solved, viewOf(tiled, graph), Vector3d(2, -1.5, 0), step);
  EXPECT_EQ(solved->place().segment, (SegmentId{0, 3}));
}

TEST(ForceShading, AtRestItStays) {
  int rested = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const TestGraph graph = randomGraph(random, 150, seed % 2 == 0);
    const WholeGraph whole(graph.segments, graph.grid);
    const TiledGraph tiled(graph, 64);
    const GraphView view = viewOf(tiled, graph);
    const auto solved = shading();
    SolverStep step;
    for (const Vector3d& h_W : jumpingProbes(whole, random, 15)) {
      const RandomStart start = randomStart(whole, random);
      solved->setPlace(view.placeAt(tiled.tileOf(start.segment), start.segment, start.t));
      for (int i = 0; i < 20; ++i) {
        const ProxyPlace before = solved->place();
        tick(*solved, view, h_W, step);
        if (!samePlace(solved->place(), before)) continue;
        ++rested;
        tick(*solved, view, h_W, step);
        ASSERT_TRUE(samePlace(solved->place(), before));
      }
    }
  }
  EXPECT_GT(rested, 1000);
}

TEST(ForceShading, WorkIsBoundedAtAHubAndRoundALoop) {
  TestGraphBuilder builder;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const std::uint32_t hub = builder.node(Vector3d(0, 0, 0));
  for (int i = 0; i < 10000; ++i) {
    const double x = unit(random), y = unit(random), z = unit(random);
    builder.link(builder.node(Vector3d(x, y, z)), hub);
  }
  const TestGraph graph = builder.build();
  const TiledGraph tiled(graph, 100000);
  const auto solved = shading(256);
  solved->setPlace(viewOf(tiled, graph).placeAt(0, {0, 1}, 0.5));
  SolverStep step;
  int capped = 0;
  for (int i = 0; i < 200; ++i) {
    const double x = unit(random), y = unit(random), z = unit(random);
    tick(*solved, viewOf(tiled, graph), Vector3d(x, y, z), step);
    ASSERT_LE(step.visited, 256u);
    ASSERT_TRUE(solved->place().p_W.allFinite());
    capped += step.capped;
  }
  EXPECT_GT(capped, 100);

  TestGraphBuilder ring;
  constexpr int kCorners = 12;
  for (int i = 0; i < kCorners; ++i) ring.node(Vector3d(std::cos(i * 0.5236), std::sin(i * 0.5236), 0.2 * (i % 3)));
  for (int i = 0; i < kCorners; ++i)
    ring.loop(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>((i + 1) % kCorners));
  const TestGraph looped = ring.build();
  const TiledGraph loop(looped, 4);
  const auto walker = shading(256);
  walker->setPlace(viewOf(loop, looped).placeAt(loop.tileOf({0, 1000000}), {0, 1000000}, 0.5));
  for (int i = 0; i < 300; ++i) {
    const double x = unit(random), y = unit(random), z = unit(random);
    tick(*walker, viewOf(loop, looped), 0.2 * Vector3d(x, y, z), step);
    ASSERT_LE(step.visited, 256u);
  }
}

TEST(ForceShading, ProbeThatIsNotFiniteChangesNothingAndFarOnesAreFollowed) {
  std::mt19937_64 random(6);
  const TestGraph graph = randomGraph(random, 100, true);
  const TiledGraph tiled(graph, 16);
  const GraphView view = viewOf(tiled, graph);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto solved = shading();
  SolverStep step;
  tick(*solved, view, Vector3d::Zero(), step);  // never placed
  EXPECT_FALSE(solved->place().valid());
  solved->setPlace(view.placeAt(0, tiled.tile(0).segmentId(0), 0.5));
  const ProxyPlace before = solved->place();
  for (const double bad : {nan, inf, -inf, 1e200}) {
    tick(*solved, view, Vector3d(0, bad, 0), step);
    EXPECT_TRUE(samePlace(solved->place(), before));
    EXPECT_EQ(step.visited, 0u);
  }
  for (const double far : {1e9, -1e20, 1e149}) {
    tick(*solved, view, Vector3d(far, far, -far), step);
    EXPECT_TRUE(solved->place().p_W.allFinite());
    EXPECT_GT(step.visited, 0u);
  }
}

}  // namespace
}  // namespace filiform::test
