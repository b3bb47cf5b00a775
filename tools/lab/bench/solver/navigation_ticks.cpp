#include "tools/lab/bench/solver/navigation_ticks.h"

#include "solver/workspace/navigation.h"
#include "tools/lab/bench/tick_times.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace filiform::tools {

namespace {

constexpr double kTick_s = 1e-3;

struct Travelled {
  std::uint64_t visited = 0;
  Vector3d p_W = Vector3d::Zero();       // after the last tick
  Vector3d forces_N = Vector3d::Zero();  // of all ticks, summed
  bool operator==(const Travelled&) const = default;
};

Navigation navigationAt(const SolverScene& scene, const Walk& walk, SolverMethod method, std::uint32_t pool_nodes) {
  SolverParameters parameters = scene.parameters;
  parameters.pool_nodes = pool_nodes;
  Navigation navigation(*scene.view, makeProxySolver(method, parameters), {});
  NavigationCommand jump;
  jump.kind = NavigationCommand::Kind::jump;
  jump.place = scene.placeOn(walk.start);
  navigation.apply(jump, Vector3d::Zero());
  NavigationCommand zoom;
  zoom.kind = NavigationCommand::Kind::zoom;
  zoom.factor = walk.zoom_um / navigation.workspace().zoom_um();
  navigation.apply(zoom, Vector3d::Zero());
  return navigation;
}

Travelled timePass(Navigation navigation, const Walk& walk, bool prepares, TickTimes& times) {
  DeviceState state;
  state.status = DeviceStatus::ready;
  Travelled travelled;
  if (prepares) navigation.prepare(kTick_s);
  for (std::size_t i = 0; i < walk.probes_W.size(); ++i) {
    state.p_D = navigation.workspace().toDevice(walk.probes_W[i]);
    state.time_s = kTick_s * static_cast<double>(i);
    const double start_ns = wallNow_ns();
    const NavigationTick& tick = navigation.tick(state, kTick_s);
    times.add(i, wallNow_ns() - start_ns);
    state.sent_N = tick.wrench.force_N;
    travelled.visited += tick.step.visited;
    travelled.p_W = tick.p_W;
    travelled.forces_N += tick.wrench.force_N;
    if (prepares) navigation.prepare(kTick_s);
  }
  return travelled;
}

struct Pair {
  TickTimes with, without;
  double visited = 0;  // a tick
};

Pair measurePair(const SolverScene& scene, const Walk& walk, SolverMethod method, int passes, double clock_ns) {
  const std::size_t ticks = walk.probes_W.size();
  Pair pair{{ticks, clock_ns}, {ticks, clock_ns}};
  for (int pass = 0; pass < passes; ++pass) {
    const Travelled with =
        timePass(navigationAt(scene, walk, method, scene.parameters.pool_nodes), walk, true, pair.with);
    const Travelled without = timePass(navigationAt(scene, walk, method, 0), walk, false, pair.without);
    if (!(with == without))
      throw std::logic_error("the pool of decoded nodes changes the path: the figures mean nothing");
    pair.visited = static_cast<double>(with.visited) / static_cast<double>(ticks);
  }
  return pair;
}

}  // namespace

void measureNavigationTicks(const std::vector<SolverScene>& scenes, const BenchOptions& options, BenchReport& report) {
  const double clock_ns = clockCost_ns(wallNow_ns);
  BenchTable table{
      "ticks",
      "Navigation::tick as the haptic loop calls it, ns. pool: decoded nodes that are kept; with a pool, prepare() "
      "runs after each tick and is not timed. Mean and last column: each tick counts once, with the median of its "
      "passes",
      {"scene", "probe", "method", "pool", "segments mean", "mean", "p99", "p99.9", "max", "p99.9 of medians"},
      {},
      {"scene", "probe", "method", "pool"}};
  double log_ratios = 0, slowest_ns = 0;
  for (const SolverScene& scene : scenes) {
    const std::vector<Walk> walks = handWalks(scene, options);
    for (const Walk& walk : walks) {
      for (const SolverMethod method : kSolverMethods) {
        options.progress(scene.name + ", " + walk.name + ", " + toString(method) + ", navigation");
        const Pair pair = measurePair(scene, walk, method, options.quick ? 2 : kBatches, clock_ns);
        const auto addRow = [&](std::uint32_t pool, const TickTimes& times) {
          const TickTimes::Single single = times.single();
          const TickTimes::OfMedians medians = times.ofMedians();
          table.rows.push_back({scene.name, walk.name, toString(method), std::int64_t{pool}, pair.visited,
                                medians.mean_ns, single.p99_ns, single.p999_ns, single.max_ns, medians.p999_ns});
          report.samples.push_back({"ticks",
                                    {scene.name, walk.name, toString(method), std::int64_t{pool}},
                                    "mean",
                                    "ns",
                                    false,
                                    times.passes_ns()});
        };
        addRow(scene.parameters.pool_nodes, pair.with);
        addRow(0, pair.without);
        log_ratios += std::log(pair.without.ofMedians().mean_ns / pair.with.ofMedians().mean_ns);
        if (&walk == &walks.front()) slowest_ns = std::max(slowest_ns, pair.with.single().p999_ns);
      }
    }
  }
  const double saved = std::exp(2 * log_ratios / static_cast<double>(table.rows.size()));
  report.tables.push_back(std::move(table));
  report.goals.push_back({"Navigation::tick, mean: without a pool / with it, geometric mean over rows", ">= 1",
                          ">= 1.5", saved, saved >= 1, saved >= 1.5});
  report.goals.push_back({"Navigation::tick, hand at ordinary speed, slowest method: p99.9, ns", "<= 1000", "<= 500",
                          slowest_ns, slowest_ns <= 1000, slowest_ns <= 500});
}

}  // namespace filiform::tools
