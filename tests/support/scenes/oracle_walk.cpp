#include "tests/support/scenes/oracle_walk.h"

#include "tests/support/no_alloc_guard.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/store_graph.h"

#include <algorithm>

namespace filiform::test {

namespace {

// Runs the same tick on both.
void tickBeside(const WalkedMethod& method, ProxySolver& solver, const GraphView& view, const Oracle& oracle,
                std::uint32_t visited, const ProbeState& probe) {
  SolverStep step;
  watchedTick(solver, view, probe, step);
  ASSERT_TRUE(samePlace(solver.place(), oracle.place()));
  ASSERT_LE(step.visited, visited);
  ASSERT_TRUE(!method.counts_everything || step.visited == visited);
  ASSERT_FALSE(step.capped);
  ASSERT_EQ(step.frontiers, 0u);
  ASSERT_EQ(step.absent.count, 0u);
}

std::uint32_t advance(Oracle& oracle, const ProbeState& probe, Walked& walked) {
  const Vector3d before_W = oracle.place().p_W;
  const std::uint32_t visited = oracle.advance(probe);
  walked.moved += oracle.place().p_W != before_W;
  walked.farthest = std::max<std::uint64_t>(walked.farthest, visited);
  return visited;
}

bool holdsTile(const TileList& list, TileId tile) {
  return std::find(list.ids.begin(), list.ids.begin() + list.count, tile) != list.ids.begin() + list.count;
}

}  // namespace

void watchedTick(ProxySolver& solver, const GraphView& view, const ProbeState& probe, SolverStep& step) {
  NoAllocGuard guard;
  solver.advance(view, probe, step);
  const ForbiddenCalls calls = guard.calls();
  ASSERT_EQ(calls.total(), 0u) << calls.first;
}

void watchedUndo(ProxySolver& solver) {
  NoAllocGuard guard;
  solver.undo();
  const ForbiddenCalls calls = guard.calls();
  ASSERT_EQ(calls.total(), 0u) << calls.first;
}

void walkInEveryTiling(const WalkedMethod& method, std::uint64_t seeds, Walked& walked) {
  constexpr std::uint32_t kCapacities[] = {4, 16, 2048};
  std::vector<std::unique_ptr<ProxySolver>> of_variant[2];
  for (std::uint64_t variant = 0; variant < 2; ++variant)
    for (std::size_t i = 0; i < std::size(kCapacities); ++i)
      of_variant[variant].push_back(method.solver(variant, method.unbounded));
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const Vector3d centre_W = seed % 8 == 7 ? Vector3d(1e9, -1e9, 1e9) : Vector3d::Zero();
    const TestGraph graph =
        randomGraph(random, 20 + static_cast<std::uint32_t>(random() % 150), seed % 3 == 0, centre_W);
    const WholeGraph whole(graph.segments, graph.grid);
    const std::vector<std::unique_ptr<ProxySolver>>& solvers = of_variant[seed % 2];
    const auto oracle = method.oracle(seed % 2, whole);
    const RandomStart start = randomStart(whole, random);
    std::vector<std::unique_ptr<TiledGraph>> tilings;
    for (std::size_t i = 0; i < solvers.size(); ++i) {
      tilings.push_back(std::make_unique<TiledGraph>(graph, kCapacities[i]));
      const TileId tile = tilings[i]->tileOf(start.segment);
      solvers[i]->setPlace(viewOf(*tilings[i], graph).placeAt(tile, start.segment, start.t));
      ASSERT_TRUE(solvers[i]->place().valid());
    }
    oracle->setPlace(solvers[0]->place());
    for (const ProbeState& probe : method.probes(whole, random)) {
      const std::uint32_t visited = advance(*oracle, probe, walked);
      for (std::size_t i = 0; i < solvers.size(); ++i) {
        SCOPED_TRACE(testing::Message() << "tiles of " << kCapacities[i]);
        tickBeside(method, *solvers[i], viewOf(*tilings[i], graph), *oracle, visited, probe);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

void walkOnTilesOfTheProduct(const WalkedMethod& method, Walked& walked) {
  std::vector<NamedCells> scenes = worstCases();
  scenes.push_back({"column", randomColumn(1, 6, 300, 60.0)});
  const auto solver = method.solver(0, method.unbounded);
  const double scales_um_m[] = {800, 2500, 8000, 80000};
  for (const NamedCells& scene : scenes) {
    for (const std::uint32_t capacity : {4u, 64u, 2048u}) {
      SCOPED_TRACE(testing::Message() << scene.name << ", capacity " << capacity);
      const StoreGraph graph(scene.cells, capacity);
      if (graph.owned.empty()) continue;
      const WholeGraph whole(graph.owned, graph.store->grid());
      const GraphView view = graph.view();
      std::mt19937_64 random(capacity);
      const auto oracle = method.oracle(0, whole);
      const std::vector<Vector3d> probes = jumpingProbes(whole, random, 24);
      for (std::size_t i = 0; i < probes.size(); ++i) {
        if (i % 8 == 0) {
          // The first start is the last segment stored: in the long-segment tile, if there is one.
          const std::size_t start = i == 0 ? graph.owned.size() - 1 : random() % graph.owned.size();
          solver->setPlace(view.placeAt(graph.owners[start], graph.owned[start].id, 0.5));
          walked.started_long += graph.owners[start] == graph.store->long_tile();
          ASSERT_TRUE(solver->place().valid());
          oracle->setPlace(solver->place());
        }
        const ProbeState probe{probes[i], 1e-3, scales_um_m[i % 4]};
        tickBeside(method, *solver, view, *oracle, advance(*oracle, probe, walked), probe);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

void walkThroughAbsentTiles(const WalkedMethod& method, std::uint64_t seeds, const std::vector<std::uint32_t>& caps,
                            Walked& walked) {
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const TestGraph graph = randomGraph(random, 150, seed % 2 == 0);
    const WholeGraph whole(graph.segments, graph.grid);
    const TiledGraph all(graph, 8);
    TiledGraph some(graph, 8);
    const std::uint32_t cap = caps[seed % caps.size()];
    const auto expected = method.solver(0, cap), actual = method.solver(0, cap);
    const RandomStart start = randomStart(whole, random);
    expected->setPlace(viewOf(all, graph).placeAt(all.tileOf(start.segment), start.segment, start.t));
    actual->setPlace(expected->place());
    SolverStep step, reference;
    for (const ProbeState& probe : method.probes(whole, random)) {
      watchedTick(*expected, viewOf(all, graph), probe, reference);
      for (TileId id = 0; id < some.tile_count(); ++id) random() % 3 == 0 ? some.load(id) : some.drop(id);
      const ProxyPlace before = actual->place();
      for (;;) {
        watchedTick(*actual, viewOf(some, graph), probe, step);
        if (step.absent.count == 0) break;
        walked.frontiers += step.frontiers;
        ASSERT_GT(step.frontiers, 0u);
        watchedUndo(*actual);
        ASSERT_TRUE(samePlace(actual->place(), before));
        ASSERT_TRUE(holdsTile(reference.touched, step.absent.ids[0]));
        for (std::uint32_t i = 0; i < step.absent.count; ++i) {
          ASSERT_EQ(some.table().find(step.absent.ids[i]), nullptr) << "was not absent";
          some.load(step.absent.ids[i]);
        }
      }
      ASSERT_EQ(step.frontiers, 0u);
      ASSERT_TRUE(samePlace(actual->place(), expected->place()));
      ASSERT_EQ(step.visited, reference.visited);
      ASSERT_EQ(step.capped, reference.capped);
    }
  }
}

}  // namespace filiform::test
