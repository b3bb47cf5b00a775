// Extreme inputs, with every method: no NaN, no force over its limit, no unbounded tick. Impossible inputs are refused
// with a clear line.
#include "device/haptic_device.h"
#include "index/errors.h"
#include "solver/graph/graph_view.h"
#include "solver/proxy/parameters.h"
#include "solver/travel/run/run.h"
#include "solver/workspace/navigation.h"
#include "tests/support/numbers.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;
using test::kInfinity;
using test::kNaN;
using test::logUniform;
using test::storeOf;

Cell points(const std::vector<Vector3d>& path) {
  Cell cell;
  for (std::uint32_t i = 0; i < path.size(); ++i) test::addSample(cell, path[i], i == 0 ? kNoParent : i - 1);
  return cell;
}

// A neurite in which every second segment has length zero, with a fork at each of them.
Cell zeroLengths() {
  Cell cell;
  std::uint32_t last = test::addSample(cell, {0, 0, 0});
  for (int i = 1; i < 60; ++i) {
    last = test::addSample(cell, {2.0 * i, 0, 0}, last);
    last = test::addSample(cell, {2.0 * i, 0, 0}, last);
    test::addSample(cell, {2.0 * i, 0, 0}, last);
  }
  return cell;
}

Cell equidistant() {  // a star of neurites tangent to a sphere: all equally far from its centre
  Cell cell;
  const std::uint32_t root = test::addSample(cell, {10, 0, 0});
  for (int i = 0; i < 40; ++i) {
    const double a = 2 * M_PI * i / 40;
    test::addSample(cell, {10 * std::cos(a), 10 * std::sin(a), 0}, root);
  }
  return cell;
}

struct Extreme {
  std::string name;
  std::unique_ptr<TileStore> store;
};

// Built once, because the comb and the hub take long.
const std::vector<Extreme>& extremes() {
  static const std::vector<Extreme> all = [] {
    std::vector<Extreme> made;
    const auto add = [&](const std::string& name, Cell cell, std::uint32_t capacity = 2048) {
      made.push_back({name, storeOf({std::move(cell)}, capacity)});
    };
    made.push_back({"nothing", storeOf({}, 8)});
    add("one node", test::isolatedNodes(1, 1, 10));
    add("one segment", points({{0, 0, 0}, {5, 0, 0}}));
    add("one segment of no length", points({{3, 3, 3}, {3, 3, 3}}));
    add("coincident nodes", test::coincidentNodes(5000), 64);
    add("zero-length segments", zeroLengths(), 16);
    add("a hub of 10 000", test::hub(10000, 30));
    add("a comb of 200 000", test::comb(200000));
    add("a neurite of 100 000", test::longNeurite(100000, 1.0));
    add("a tiny structure at 1e9 um",
        points({{1e9, -1e9, 1e9}, {1e9 - 0.125, -1e9, 1e9}, {1e9 - 0.25, -1e9 + 0.125, 1e9}}));
    add("segments of 1e-9 and 1e6 um", points({{0, 0, 0}, {1e-9, 0, 0}, {1e6, 0, 0}, {1e6, 1, 0}, {-1e6, 1, 1}}), 4);
    add("all equidistant", equidistant(), 8);
    return made;
  }();
  return all;
}

struct Corner {
  double zoom_um, stiffness_N_m, dt_s;
};

// The limits of every range, and random values between them.
std::vector<Corner> corners() {
  std::vector<Corner> all{{300, 200, 1e-3}, {1e-6, 200, 1e-3}, {1e6, 200, 1e-3}, {300, 1e-3, 1e-3}, {300, 1e6, 1e-3},
                          {300, 200, 1e-6}, {300, 200, 1},     {1e-6, 1e6, 1},   {1e6, 1e6, 1e-6},  {1e6, 1e-3, 1}};
  std::mt19937_64 random(23);
  for (int i = 0; i < 3; ++i)
    all.push_back({logUniform(random, 1e-6, 1e6), logUniform(random, 1e-3, 1e6), logUniform(random, 1e-6, 1)});
  return all;
}

// The hand's position at tick i: not finite, absurdly far, jumping by 1 m a tick, or moving like a real hand.
Vector3d wildHandAt(std::mt19937_64& random, int i) {
  if (i % 23 == 5) return {kNaN, 0, 0};
  if (i % 23 == 11) return {0, -kInfinity, kInfinity};
  if (i % 23 == 17) return Vector3d::Constant(i % 2 ? 1e300 : -1e155);
  if (i % 40 > 30) return {i % 2 ? 0.5 : -0.5, 0.1, 0};
  const double s = 0.01 * i + 1e-3 * static_cast<double>(random() % 100);
  return {0.05 * std::sin(3 * s), 0.05 * std::cos(2 * s), 0.05 * std::sin(s)};
}

TEST(Extremes, NoNanNoForceOverItsLimitNoUnboundedTick) {
  for (const Extreme& extreme : extremes()) {
    SCOPED_TRACE(extreme.name);
    const TileStore& store = *extreme.store;
    std::vector<std::shared_ptr<const Tile>> held;
    TileTable table(store.tile_count());
    for (TileId id = 0; id < store.tile_count(); ++id) {
      held.push_back(store.load(id));
      table.add(*held.back());
    }
    const GraphView graph(table, store.leaves(), store.grid());
    SolverParameters parameters;
    parameters.r_min_um = 1;
    parameters.r_max_um = 50;
    for (const SolverMethod method : kSolverMethods) {
      SCOPED_TRACE(static_cast<int>(method));
      std::uint64_t refused = 0, visited = 0;
      for (const Corner& corner : corners()) {
        SCOPED_TRACE(corner.zoom_um);
        std::mt19937_64 random(3);
        NavigationOptions options;
        options.force.stiffness_N_m = corner.stiffness_N_m;
        options.workspace.zoom_um = corner.zoom_um;
        options.force.passivity.on = random() % 2 == 0;
        options.force.passivity.delay_samples = static_cast<int>(random() % 9);
        Navigation navigation(graph, makeProxySolver(method, parameters), options);
        if (store.tile_count() > 0) {
          const Tile& tile = *held[random() % held.size()];
          NavigationCommand jump;
          jump.kind = NavigationCommand::Kind::jump;
          jump.place = graph.placeAt(tile.id(),
                                     tile.segmentId(static_cast<std::uint32_t>(random() % tile.segment_count())), 0.5);
          ASSERT_TRUE(jump.place.valid());
          ASSERT_TRUE(navigation.apply(jump, Vector3d::Zero()));
        }
        for (int i = 0; i < 60; ++i) {
          if (i % 20 == 13) {  // some commands have values out of range
            NavigationCommand zoom;
            zoom.kind = NavigationCommand::Kind::zoom;
            zoom.factor = i % 40 == 13 ? 1e9 : kNaN;
            navigation.apply(zoom, Vector3d::Zero());
          }
          DeviceState state;
          state.p_D = wildHandAt(random, i);
          state.v_D = i % 7 == 0 ? Vector3d::Constant(kNaN) : Vector3d::Zero();
          state.status = DeviceStatus::ready;
          const NavigationTick& tick = navigation.tick(state, corner.dt_s);
          ASSERT_TRUE(tick.wrench.force_N.allFinite());
          ASSERT_LE(tick.wrench.force_N.norm(), options.force.max_force_N * (1 + 1e-12));
          ASSERT_TRUE(tick.p_W.allFinite());
          ASSERT_LE(tick.step.visited, parameters.max_visited);
          ASSERT_FALSE(tick.frontier);
          visited += tick.step.visited;
        }
        ASSERT_TRUE(std::isfinite(navigation.force_law().energy().observed));
        ASSERT_TRUE(std::isfinite(navigation.force_law().energy().least));
        refused += navigation.force_law().events().not_finite;
      }
      if (store.tile_count() > 0) {
        EXPECT_GT(refused, 0u);
        EXPECT_GT(visited, 0u);
      }
    }
  }
}

TEST(Extremes, RunsAtTheSmallestBudget) {
  for (const Extreme& extreme : extremes()) {
    if (extreme.name != "a hub of 10 000" && extreme.name != "a comb of 200 000" &&
        extreme.name != "zero-length segments")
      continue;
    SCOPED_TRACE(extreme.name);
    for (const SolverMethod method : kSolverMethods) {
      RunOptions options;
      options.method = method;
      options.solver = SolverParameters{};
      options.budget_bytes = Residency::floorBytes(*extreme.store);
      options.seconds = 0.3;
      const RunSummary summary = run(*extreme.store, options, [](const TickRow& row) {
        ASSERT_TRUE(row.force_N.allFinite());
        ASSERT_LE(row.visited, SolverParameters{}.max_visited);
      });
      EXPECT_LE(summary.peak_bytes, *options.budget_bytes);
      EXPECT_EQ(summary.ticks, 300u);
    }
  }
}

TEST(Extremes, RunsAtEveryRateAndDelay) {
  const auto store = storeOf({test::randomNeuron(4, {.samples = 300})}, 64);
  for (const SolverMethod method : kSolverMethods) {
    for (const double rate_Hz : {1.0, 30.0, 1e4, 1e6}) {
      for (const int delay : {0, 1, 2}) {
        for (const bool controller : {false, true}) {
          RunOptions options;
          options.in_memory = true;
          options.method = method;
          options.rate_Hz = rate_Hz;
          options.delay_samples = delay;
          options.passivity = controller;
          options.seconds = 200 / rate_Hz;
          const RunSummary summary = run(*store, options, [](const TickRow& row) {
            ASSERT_TRUE(row.force_N.allFinite() && row.p_W.allFinite() && row.h_W.allFinite());
            ASSERT_LE(row.force_N.norm(), 8 * (1 + 1e-12));
          });
          EXPECT_LE(summary.ticks, 200u);
          EXPECT_TRUE(std::isfinite(summary.energy.least));
        }
      }
    }
  }
}

TEST(Extremes, ImpossibleInputsAreRefusedWithAReason) {
  Cell two = points({{0, 0, 0}, {5, 0, 0}, {9, 0, 0}});
  test::addSample(two, {100, 0, 0});
  test::addSample(two, {105, 0, 0}, 3);
  const auto store = storeOf({two, test::isolatedNodes(3, 4, 10)}, 8);
  const auto refuses = [&](const std::string& says, auto change) {
    RunOptions options;
    options.cell = 0;
    options.in_memory = true;
    change(options);
    try {
      run(*store, options);
      ADD_FAILURE() << "not refused: " << says;
    } catch (const UsageError& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  };
  refuses("not connected", [](RunOptions& o) { o.route = routeChoiceOf("1:5"); });
  refuses("no sample 77", [](RunOptions& o) { o.route = routeChoiceOf("1:77"); });
  refuses("none of its segments has a length", [](RunOptions& o) { o.cell = 1; });
  refuses("none of its segments has a length", [](RunOptions& o) {
    o.cell = 1;
    o.route = routeChoiceOf("tour:1");
  });
  refuses("stiffness", [](RunOptions& o) { o.stiffness_N_m = kNaN; });
  refuses("stiffness", [](RunOptions& o) { o.stiffness_N_m = -1; });
  refuses("zoom", [](RunOptions& o) { o.zoom_um = -1; });
  refuses("zoom", [](RunOptions& o) { o.zoom_um = kInfinity; });
  refuses("rate", [](RunOptions& o) { o.rate_Hz = kNaN; });
  refuses("rate", [](RunOptions& o) { o.rate_Hz = 1e9; });
  refuses("max_visited", [](RunOptions& o) { o.solver.emplace().max_visited = 0; });
  refuses("gain", [](RunOptions& o) { o.solver.emplace().gain = kNaN; });
  refuses("r_max_um", [](RunOptions& o) { o.solver.emplace().r_max_um = -1; });
  refuses("time limit", [](RunOptions& o) { o.seconds = kNaN; });
  refuses("latency", [](RunOptions& o) { o.latency_ms = kInfinity; });
  const auto empty = storeOf({}, 8);
  EXPECT_THROW(run(*empty, {}), UsageError);
}

}  // namespace
}  // namespace filiform
