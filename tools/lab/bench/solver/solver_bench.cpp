// filiform bench solver: what a tick costs, of navigation and of each proxy solver, beside a literal transcription.
#include "tools/lab/bench/solver/navigation_ticks.h"
#include "tools/lab/bench/solver/solver_scenes.h"
#include "tools/lab/bench/tick_times.h"
#include "tools/lab/bench/workloads.h"
#include "tools/lab/reference/literal_solver.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <pthread.h>
#include <random>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::size_t kBatch = 1000;  // ticks

struct TickCosts {
  double mean_ns = 0, literal_ns = 0;  // a tick, of whole batches: medians over batches
  double ratio = 0;                    // median over pairs of batches of literal / fast; 0: no literal form
  double visited = 0;
  std::uint32_t most_visited = 0;
  std::uint64_t capped = 0;
  std::vector<double> passes_ns;  // mean_ns of each pass
  TickTimes ticks;
};

// Both go over the same probes, batch by batch in turn: first for the means, then tick by tick for the percentiles.
TickCosts measureTicks(const SolverScene& scene, const Walk& walk, SolverMethod method, int passes, double clock_ns) {
  const auto solver = makeProxySolver(method, scene.parameters);
  const bool has_literal = LiteralSolver::knows(method);
  LiteralSolver literal(*scene.whole, method, scene.parameters);
  SolverStep step;
  TickCosts costs{.passes_ns = {}, .ticks = {walk.probes_W.size(), clock_ns}};
  std::vector<double> fast, slow, ratios;
  const ProxyPlace start = scene.placeOn(walk.start);
  const auto probeAt = [&](std::size_t i) { return ProbeState{walk.probes_W[i], 1e-3, walk.scale_um_m()}; };
  double check = 0;
  for (int pass = 0; pass <= passes; ++pass) {  // the first one warms up
    solver->setPlace(start);
    literal.setPlace(start);
    for (std::size_t begin = 0; begin + kBatch <= walk.probes_W.size(); begin += kBatch) {
      const double start_ns = wallNow_ns();
      for (std::size_t i = begin; i < begin + kBatch; ++i) solver->advance(*scene.view, probeAt(i), step);
      const double fast_ns = (wallNow_ns() - start_ns) / kBatch;
      double literal_ns = 0;
      if (has_literal) {
        const double literal_start_ns = wallNow_ns();
        for (std::size_t i = begin; i < begin + kBatch; ++i) literal.advance(walk.probes_W[i]);
        literal_ns = (wallNow_ns() - literal_start_ns) / kBatch;
        check += (literal.p_W() - solver->place().p_W).norm();
      }
      if (pass == 0) continue;
      fast.push_back(fast_ns);
      if (!has_literal) continue;
      slow.push_back(literal_ns);
      ratios.push_back(literal_ns / fast_ns);
    }
    if (pass > 0) {
      const auto batches = static_cast<std::ptrdiff_t>(fast.size()) / pass;
      costs.passes_ns.push_back(percentile({fast.end() - batches, fast.end()}, 0.5));
    }
    solver->setPlace(start);
    for (std::size_t i = 0; i < walk.probes_W.size(); ++i) {
      const ProbeState probe = probeAt(i);
      const double start_ns = wallNow_ns();
      solver->advance(*scene.view, probe, step);
      const double ns = wallNow_ns() - start_ns;
      if (pass > 0) {
        costs.ticks.add(i, ns);
        continue;
      }
      costs.visited += step.visited;
      costs.most_visited = std::max(costs.most_visited, step.visited);
      costs.capped += step.capped;
    }
  }
  if (check != 0 && costs.capped == 0)
    throw std::logic_error("the solver and its literal transcription part: the figures mean nothing");
  costs.mean_ns = percentile(fast, 0.5);
  costs.literal_ns = has_literal ? percentile(slow, 0.5) : 0;
  costs.ratio = has_literal ? percentile(ratios, 0.5) : 0;
  costs.visited /= static_cast<double>(walk.probes_W.size());
  return costs;
}

// Evicts everything else from the caches.
class Flusher {
 public:
  explicit Flusher(std::size_t bytes) : walked_(bytes, 1) {}
  void flush() {
    for (std::size_t i = 0; i < walked_.size(); i += 64) sum_ += ++walked_[i];
  }
  std::uint64_t sum() const { return sum_; }

 private:
  std::vector<unsigned char> walked_;
  std::uint64_t sum_ = 0;
};

struct ColdCosts {
  std::vector<double> us, undo_us;
};

// Times one tick from each of many random places, after a flush, towards a probe that sends the search far. Keeps ticks
// of 200 segments and more. `prepares`: prepare() decodes nodes around the place before the flush, as before most
// ticks; false: as in the first tick after a jump.
ColdCosts measureCold(const SolverScene& scene, SolverMethod method, bool prepares, int rounds, std::uint64_t seed,
                      Flusher& flusher, double clock_ns) {
  std::mt19937_64 random(seed);
  const auto solver = makeProxySolver(method, scene.parameters);
  SolverStep step;
  ColdCosts costs;
  for (int i = 0; i < rounds; ++i) {
    const std::size_t at = scene.anyOwned(random);
    solver->setPlace(scene.placeOn(at));
    const Vector3d away_W = 3e3 * inCube(random);
    const ProbeState probe{scene.view->grid().toWorld(scene.owned[at].child) + away_W, 1e-3, 1e6 / 0.12};
    for (int k = 0; prepares && k < 20; ++k) solver->prepare(*scene.view, probe.h_W, 64);
    flusher.flush();
    const double start_ns = threadNow_ns();
    solver->advance(*scene.view, probe, step);
    const double end_ns = threadNow_ns();
    if (!step.capped && step.visited < 200) continue;
    costs.us.push_back(std::max(0.0, end_ns - start_ns - clock_ns) * 1e-3);
    const double undo_ns = threadNow_ns();
    solver->undo();
    costs.undo_us.push_back(std::max(0.0, threadNow_ns() - undo_ns - clock_ns) * 1e-3);
  }
  return costs;
}

void measureWarm(const std::vector<SolverScene>& scenes, const BenchOptions& options, BenchReport& report) {
  const double clock_ns = clockCost_ns(wallNow_ns);
  const int passes = options.quick ? 2 : kBatches;
  BenchTable warm{
      "warm",
      "the solver alone, one tick, caches warm, without prepare(), ns. literal: the paper's rules with recursion and "
      "hash sets over one flat graph, on the same probes",
      {"scene", "probe", "method", "segments mean", "most", "mean", "p50", "p99", "p99.9", "max", "literal mean",
       "literal / this", "p99 of medians"},
      {},
      {"scene", "probe", "method"}};
  double least_ratio = 1e300, worst_p99 = 0;
  for (const SolverScene& scene : scenes) {
    const std::vector<Walk> walks = handWalks(scene, options);
    for (const Walk& walk : walks) {
      for (const SolverMethod method : kSolverMethods) {
        options.progress(scene.name + ", " + walk.name + ", " + toString(method));
        const TickCosts c = measureTicks(scene, walk, method, passes, clock_ns);
        const TickTimes::Single single = c.ticks.single();
        warm.rows.push_back({scene.name, walk.name, toString(method), c.visited, std::int64_t{c.most_visited},
                             c.mean_ns, single.p50_ns, single.p99_ns, single.p999_ns, single.max_ns,
                             c.ratio > 0 ? BenchValue(c.literal_ns) : BenchValue("-"),
                             c.ratio > 0 ? BenchValue(c.ratio) : BenchValue("-"), c.ticks.ofMedians().p99_ns});
        report.samples.push_back({"warm", {scene.name, walk.name, toString(method)}, "mean", "ns", false, c.passes_ns});
        if (method == SolverMethod::force && &walk == &walks.front()) {
          least_ratio = std::min(least_ratio, c.ratio);
          worst_p99 = std::max(worst_p99, single.p99_ns);
        }
      }
    }
  }
  report.tables.push_back(std::move(warm));
  report.goals.push_back({"force-based tick, warm, hand at ordinary speed: literal / this", ">= 3", ">= 4", least_ratio,
                          least_ratio >= 3, least_ratio >= 4});
  report.goals.push_back({"force-based tick, warm, hand at ordinary speed: p99, ns", "<= 100", "<= 60", worst_p99,
                          worst_p99 <= 100, worst_p99 <= 60});
}

void measureColdTicks(const std::vector<SolverScene>& scenes, const BenchOptions& options, BenchReport& report) {
  const double clock_ns = clockCost_ns(threadNow_ns);
  Flusher flusher(options.quick ? 8u << 20 : 96u << 20);
  BenchTable cold{
      "cold",
      "the solver alone, one tick of 200 to 256 segments with cold caches, us. decoded ahead: prepare() ran before "
      "the tick",
      {"scene", "method", "decoded ahead", "ticks", "p50", "p99", "max", "undo max"},
      {},
      {"scene", "method", "decoded ahead"}};
  double worst_us[2] = {0, 0};  // with nothing decoded ahead; with
  for (const SolverScene& scene : scenes) {
    for (const SolverMethod method : kSolverMethods) {
      options.progress(scene.name + ", cold, " + toString(method));
      for (const bool prepares : {false, true}) {
        const ColdCosts c =
            measureCold(scene, method, prepares, options.quick ? 10 : 150, options.seed, flusher, clock_ns);
        if (c.us.empty()) continue;
        const double p99 = percentile(c.us, 0.99);
        cold.rows.push_back({scene.name, toString(method), prepares ? "yes" : "no",
                             static_cast<std::int64_t>(c.us.size()), percentile(c.us, 0.5), p99, percentile(c.us, 1.0),
                             percentile(c.undo_us, 1.0)});
        worst_us[prepares] = std::max(worst_us[prepares], p99);
      }
    }
  }
  report.tables.push_back(std::move(cold));
  report.goals.push_back({"capped tick, cold caches, without prepare(), worst scene and method: p99, us", "<= 50",
                          "<= 25", worst_us[0], worst_us[0] <= 50, worst_us[0] <= 25});
  report.goals.push_back({"capped tick, cold caches, after prepare(), worst scene and method: p99, us", "<= 100",
                          "<= 50", worst_us[1], worst_us[1] <= 100, worst_us[1] <= 50});
  report.notes.push_back(
      "Cold ticks cannot be repeated. They are measured in CPU time of the thread, which leaves out the time of other "
      "programs, but not what they do to the caches.");
  if (flusher.sum() == 0) report.notes.push_back("nothing was flushed");
}

BenchReport runSolver(const BenchOptions& options) {
  options.progress("scenes");
  std::vector<SolverScene> scenes = cellScenes(options);
  BenchReport report;
  measureNavigationTicks(scenes, options, report);
  measureWarm(scenes, options, report);
  options.progress("cold caches");
  addExtremeScenes(scenes, options);
  measureColdTicks(scenes, options, report);

  report.notes.push_back("Ordinary speed: 0.125 um a tick, 50 mm/s at 300 um across 12 cm.");
  report.notes.push_back(
      "Means of the solver alone: batches of " + std::to_string(kBatch) +
      " ticks under one pair of clock reads, this and literal in turn; medians over batches, the ratio over pairs.");
  report.notes.push_back("p50, p99, p99.9 and max: over the single ticks of " +
                         std::to_string(options.quick ? 2 : kBatches) +
                         " passes over the same probes. The time of two clock reads (" +
                         std::to_string(std::lround(clockCost_ns(wallNow_ns))) +
                         " ns) is subtracted. Interruptions by other programs are included, except in columns of "
                         "medians, where each tick counts once, with the median of its passes.");
  return report;
}

// The literal transcription recurses once a segment: on a long neurite the recursion overflows a usual stack. So the
// workload runs on a thread with a stack of 1 GiB, of which only the used pages take memory.
BenchReport runOnDeepStack(const BenchOptions& options) {
  struct Call {
    const BenchOptions& options;
    BenchReport report;
    std::exception_ptr error;
  } call{options, {}, nullptr};
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, std::size_t{1} << 30);
  pthread_t thread;
  const int refused = pthread_create(
      &thread, &attributes,
      [](void* argument) -> void* {
        Call& of = *static_cast<Call*>(argument);
        try {
          of.report = runSolver(of.options);
        } catch (...) {
          of.error = std::current_exception();
        }
        return nullptr;
      },
      &call);
  pthread_attr_destroy(&attributes);
  if (refused != 0) throw std::system_error(refused, std::generic_category(), "a thread with a stack of 1 GiB");
  pthread_join(thread, nullptr);
  if (call.error) std::rethrow_exception(call.error);
  return std::move(call.report);
}

}  // namespace

void addSolverWorkloads(std::vector<Workload>& all) {
  all.push_back(
      {"solver",
       "what a tick of navigation and of each proxy solver costs, those of the paper beside a literal transcription",
       runOnDeepStack});
}

}  // namespace filiform::tools
