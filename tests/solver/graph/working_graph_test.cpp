// The pool of decoded nodes changes no result, whatever its size, and is not used after its tiles retire.
#include "solver/graph/internal/working_graph.h"

#include "tests/support/no_alloc_guard.h"
#include "tests/support/scenes/oracle_walk.h"
#include "tests/support/scenes/proxy_walk.h"
#include "tests/support/scenes/test_graph.h"

#include <memory>
#include <set>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

using internal::WorkingGraph;
using Presence = WorkingGraph::Presence;

std::unique_ptr<ProxySolver> solverWithPool(SolverMethod method, std::uint32_t max_visited, std::uint32_t pool_nodes) {
  SolverParameters parameters = livelyParameters(max_visited);
  parameters.pool_nodes = pool_nodes;
  return makeProxySolver(method, parameters);
}

bool sameStep(const SolverStep& a, const SolverStep& b) {
  const auto same = [](const TileList& x, const TileList& y) {
    return x.count == y.count && std::equal(x.ids.begin(), x.ids.begin() + x.count, y.ids.begin());
  };
  return a.visited == b.visited && a.capped == b.capped && a.frontiers == b.frontiers && same(a.touched, b.touched) &&
         same(a.absent, b.absent);
}

class WorkingGraphPool : public testing::TestWithParam<SolverMethod> {};

INSTANTIATE_TEST_SUITE_P(Methods, WorkingGraphPool, testing::ValuesIn(kSolverMethods), [](const auto& method) {
  std::string name = toString(method.param);
  std::erase(name, '-');
  return name;
});

// Tiles are added and retired, ticks are undone, and nodes are prepared after some ticks.
TEST_P(WorkingGraphPool, ChangesNoPath) {
  constexpr std::uint32_t kPools[] = {0, 64, 4096, 4096};
  std::uint64_t frontiers = 0;
  for (std::uint64_t seed = 0; seed < 16; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const TestGraph graph = randomGraph(random, 400, seed % 2 == 0);
    const WholeGraph whole(graph.segments, graph.grid);
    TiledGraph tiled(graph, seed % 4 < 2 ? 8 : 64);
    const GraphView view = viewOf(tiled, graph);
    const std::uint32_t caps[] = {256, 5, 40};
    std::vector<std::unique_ptr<ProxySolver>> solvers;
    const RandomStart start = randomStart(whole, random);
    for (const std::uint32_t pool : kPools) {
      solvers.push_back(solverWithPool(GetParam(), caps[seed % 3], pool));
      solvers.back()->setPlace(view.placeAt(tiled.tileOf(start.segment), start.segment, start.t));
    }
    std::vector<Vector3d> probes = smoothProbes(whole, random, 100);
    for (const Vector3d& h_W : jumpingProbes(whole, random, 40)) probes.insert(probes.end(), 2, h_W);
    for (const Vector3d& h_W : probes) {
      if (random() % 10 == 0)
        for (TileId id = 0; id < tiled.tile_count(); ++id) random() % 3 == 0 ? tiled.drop(id) : tiled.load(id);
      const bool undone = random() % 6 == 0, prepared = random() % 2 == 0;
      SolverStep expected, step;
      for (std::size_t i = 0; i < solvers.size(); ++i) {
        ProxySolver& solver = *solvers[i];
        if (undone) {
          watchedTick(solver, view, {h_W + Vector3d(1, 2, 3)}, step);
          watchedUndo(solver);
        }
        watchedTick(solver, view, {h_W}, i == 0 ? expected : step);
        ASSERT_TRUE(samePlace(solver.place(), solvers[0]->place())) << "pool of " << kPools[i];
        ASSERT_EQ(solver.place().tile, solvers[0]->place().tile);
        ASSERT_TRUE(i == 0 || sameStep(step, expected)) << "pool of " << kPools[i];
        NoAllocGuard guard;
        if (prepared && i != 2) solver.prepare(view, h_W, 50);
        ASSERT_EQ(guard.calls().total(), 0u);
      }
      frontiers += expected.frontiers;
    }
  }
  EXPECT_GT(frontiers, 20u);
}

TEST_P(WorkingGraphPool, MayBeSmallerThanAHub) {
  TestGraphBuilder builder;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-5, 5);
  const std::uint32_t hub = builder.node(Vector3d(0, 0, 0));
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t twig = builder.node(Vector3d(unit(random), unit(random), unit(random)));
    builder.link(twig, hub);
    builder.link(builder.node(Vector3d(unit(random), unit(random), unit(random))), twig);
  }
  const TestGraph graph = builder.build();
  const WholeGraph whole(graph.segments, graph.grid);
  const TiledGraph tiled(graph, 32);
  const GraphView view = viewOf(tiled, graph);
  std::vector<std::unique_ptr<ProxySolver>> solvers;
  for (const std::uint32_t pool : {0u, 64u, 4096u}) {
    solvers.push_back(solverWithPool(GetParam(), 256, pool));
    solvers.back()->setPlace(view.placeAt(tiled.tileOf({0, 1}), {0, 1}, 0.5));
  }
  std::set<std::uint32_t> segments;
  for (const Vector3d& h_W : jumpingProbes(whole, random, 300)) {
    SolverStep expected, step;
    watchedTick(*solvers[0], view, {h_W}, expected);
    for (std::size_t i = 1; i < solvers.size(); ++i) {
      watchedTick(*solvers[i], view, {h_W}, step);
      solvers[i]->prepare(view, h_W, 64);
      ASSERT_TRUE(samePlace(solvers[i]->place(), solvers[0]->place()));
      ASSERT_TRUE(sameStep(step, expected));
    }
    segments.insert(solvers[0]->place().segment.segment);
  }
  EXPECT_GT(segments.size(), 5u);
}

// A neurite along x with segments of 1 um, in small tiles.
struct Neurite {
  TestGraph graph;
  TiledGraph tiled;

  Neurite() : graph(build()), tiled(graph, 8) {}
  static TestGraph build() {
    TestGraphBuilder builder;
    std::uint32_t last = builder.node(Vector3d(0, 0, 0));
    for (int i = 1; i < 400; ++i) {
      const std::uint32_t next = builder.node(Vector3d(i, 0, 0));
      builder.link(next, last);
      last = next;
    }
    return builder.build();
  }
  GraphView view() const { return viewOf(tiled, graph); }
  static WorkingGraph::Seen at(std::uint32_t sample) { return {{0, sample}, Vector3d(sample, 0, 0)}; }
};

TEST(WorkingGraph, ATileThatRetiresTakesItsOwnNodesOutAlone) {
  Neurite neurite;
  const GraphView view = neurite.view();
  WorkingGraph graph(4096, 100, 0);
  graph.begin(view);
  std::uint32_t local[300];
  for (std::uint32_t sample = 100; sample < 130; ++sample) {
    local[sample] = graph.meet(Neurite::at(sample));
    ASSERT_EQ(graph.open(local[sample]), Presence::present);
  }
  const TileId retired = graph.node(local[115]).home;
  neurite.tiled.drop(retired);
  graph.begin(view);
  int absent = 0;
  for (std::uint32_t sample = 100; sample < 130; ++sample) {
    ASSERT_EQ(graph.find({0, sample}), local[sample]);
    const bool present = graph.open(local[sample]) == Presence::present;
    EXPECT_EQ(present, graph.node(local[sample]).home != retired);
    absent += !present;
  }
  EXPECT_GT(absent, 0);
  EXPECT_LT(absent, 20);
  neurite.tiled.load(retired);
  graph.begin(view);
  EXPECT_EQ(graph.open(local[115]), Presence::present);
  EXPECT_EQ(graph.node(local[115]).degree, 2u);
}

TEST(WorkingGraph, KeepsTheLastNodesAndThoseOfTheSearch) {
  Neurite neurite;
  const GraphView view = neurite.view();
  WorkingGraph graph(10, 50, 0);
  graph.begin(view);
  graph.newSearch();
  static_cast<void>(graph.label(graph.meet(Neurite::at(0))));
  for (std::uint32_t sample = 1; sample < 40; ++sample) static_cast<void>(graph.meet(Neurite::at(sample)));
  EXPECT_NE(graph.find({0, 0}), WorkingGraph::kNone);  // labelled
  EXPECT_EQ(graph.find({0, 29}), WorkingGraph::kNone);
  EXPECT_NE(graph.find({0, 30}), WorkingGraph::kNone);
  graph.newSearch();
  EXPECT_EQ(graph.find({0, 0}), WorkingGraph::kNone);
  graph.forget();
  EXPECT_EQ(graph.find({0, 39}), WorkingGraph::kNone);
}

TEST(WorkingGraph, PreparesWhatLiesAheadFirst) {
  Neurite neurite;
  const GraphView view = neurite.view();
  WorkingGraph graph(4096, 100, 0);
  const auto keeps = [&](std::uint32_t sample) { return graph.find({0, sample}) != WorkingGraph::kNone; };
  graph.prepare(view, {Neurite::at(200), Neurite::at(199)}, Vector3d(250, 0, 0), 40);
  EXPECT_TRUE(keeps(238));
  EXPECT_FALSE(keeps(245));
  EXPECT_FALSE(keeps(190));
  graph.prepare(view, {Neurite::at(200), Neurite::at(199)}, Vector3d(250, 0, 0), 60);  // continues
  EXPECT_TRUE(keeps(255));
  EXPECT_TRUE(keeps(190));
}

TEST(WorkingGraph, PreparesPastNoAbsentTile) {
  Neurite neurite;
  const GraphView view = neurite.view();
  const TileId absent = view.leaves().home(neurite.graph.grid.snap(Vector3d(220, 0, 0)));
  neurite.tiled.drop(absent);
  WorkingGraph graph(4096, 100, 0);
  graph.prepare(view, {Neurite::at(200), Neurite::at(199)}, Vector3d(250, 0, 0), 100);
  EXPECT_EQ(graph.find({0, 240}), WorkingGraph::kNone);
  neurite.tiled.load(absent);
  graph.prepare(view, {Neurite::at(200), Neurite::at(199)}, Vector3d(250, 0, 0), 100);
  EXPECT_NE(graph.find({0, 240}), WorkingGraph::kNone);
}

}  // namespace
}  // namespace filiform::test
