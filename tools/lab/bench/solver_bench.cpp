// filiform bench solver: what a tick of each proxy solver costs, beside the literal transcription of the paper.
#include "index/build/memory_tiles.h"
#include "solver/graph/graph_view.h"
#include "solver/proxy/parameters.h"
#include "tools/lab/bench/dense_cells.h"
#include "tools/lab/bench/extreme_cells.h"
#include "tools/lab/bench/literal_solver.h"
#include "tools/lab/bench/workloads.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <exception>
#include <memory>
#include <pthread.h>
#include <random>
#include <system_error>
#include <utility>

namespace filiform::tools {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kBatch = 1000;  // ticks

double nanoseconds(Clock::duration d) { return std::chrono::duration<double, std::nano>(d).count(); }

// What reading the clock twice takes by itself.
template <typename Now>
double clockCost(const Now& now_ns) {
  std::vector<double> costs;
  for (int i = 0; i < 10001; ++i) {
    const double start_ns = now_ns();
    costs.push_back(now_ns() - start_ns);
  }
  return percentile(costs, 0.5);
}

double wallNow_ns() { return nanoseconds(Clock::now().time_since_epoch()); }

// Of this thread: stands still while others have the processor. Dearer to read.
double threadNow_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

// Cells as tiles, all resident, and as one flat graph.
struct SolverScene {
  std::string name;
  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> tiles;
  std::unique_ptr<TileTable> table;
  std::unique_ptr<GraphView> view;
  std::vector<StoredSegment> owned;
  std::vector<TileId> owners;  // of `owned`
  std::unique_ptr<WholeGraph> whole;
  SolverParameters parameters;  // of the first cell

  SolverScene(std::string scene_name, std::vector<Cell> cells) : name(std::move(scene_name)) {
    CellList stream(std::move(cells));
    store = buildTilesInMemory(stream);
    table = std::make_unique<TileTable>(store->tile_count());
    for (TileId id = 0; id < store->tile_count(); ++id) {
      tiles.push_back(store->load(id));
      const Tile& tile = *tiles.back();
      table->add(tile);
      for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
        if (!tile.owned(s)) continue;
        const std::uint32_t child = tile.child(s), parent = tile.parent(s);
        owned.push_back({tile.segmentId(s), tile.nodeId(child).sample, tile.nodeId(parent).sample,
                         tile.gridPoint(child), tile.gridPoint(parent), true});
        owners.push_back(id);
      }
    }
    view = std::make_unique<GraphView>(*table, store->leaves(), store->grid());
    whole = std::make_unique<WholeGraph>(owned, store->grid());
    parameters = automaticParameters(*store, 0);
  }

  std::size_t anyOwned(std::mt19937_64& random) const {
    for (;;) {
      const std::size_t at = random() % owned.size();
      if (owned[at].child != owned[at].parent) return at;
    }
  }
  ProxyPlace placeOn(std::size_t at) const { return view->placeAt(owners[at], owned[at].id, 0.5); }
};

struct Walk {
  std::string name;
  std::size_t start;  // in SolverScene::owned
  double scale_um_m;
  std::vector<Vector3d> probes;
};

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }
Vector3d cube(std::mt19937_64& random) {
  const double x = uniform(random), y = uniform(random), z = uniform(random);
  return 2.0 * Vector3d(x, y, z) - Vector3d::Ones();
}

// A hand that goes along the threads, turning where they branch, at so many um a tick, with a smooth deviation of about
// `off_um`.
Walk alongNeurites(const SolverScene& scene, double um_a_tick, double off_um, std::size_t ticks, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const WholeGraph& whole = *scene.whole;
  Walk walk{std::to_string(um_a_tick), scene.anyOwned(random), 2500, {}};
  walk.name.erase(walk.name.find_last_not_of('0') + 1);
  walk.name = "hand, " + walk.name + " um a tick";
  std::uint32_t segment = whole.segment(scene.owned[walk.start].id);
  std::uint32_t from = whole.segments()[segment].child;
  double along = 0;
  Vector3d off_W = Vector3d::Zero(), drift_W = Vector3d::Zero();
  while (walk.probes.size() < ticks) {
    const WholeGraph::Segment& s = whole.segments()[segment];
    const std::uint32_t to = s.child == from ? s.parent : s.child;
    const Vector3d from_W = whole.nodes()[from].p_W, to_W = whole.nodes()[to].p_W;
    const double length = (to_W - from_W).norm();
    while (along < length && walk.probes.size() < ticks) {
      drift_W += 0.02 * cube(random) - 0.01 * drift_W - 1e-4 * off_W / off_um;
      off_W = 0.999 * off_W + 0.01 * off_um * drift_W;
      walk.probes.push_back(from_W + (along / length) * (to_W - from_W) + off_W);
      along += um_a_tick;
    }
    along -= length;
    const std::vector<std::uint32_t>& incident = whole.nodes()[to].incident;
    std::uint32_t next = segment;  // back where it ends
    if (incident.size() > 1) do
        next = incident[random() % incident.size()];
      while (next == segment);
    segment = next;
    from = to;
  }
  return walk;
}

Walk jumps(const SolverScene& scene, std::size_t ticks, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Walk walk{"jumps anywhere, each tick", scene.anyOwned(random), 2500, {}};
  while (walk.probes.size() < ticks)
    walk.probes.push_back(scene.whole->nodes()[random() % scene.whole->nodes().size()].p_W + 5.0 * cube(random));
  return walk;
}

struct TickCosts {
  double mean_ns = 0, literal_ns = 0;            // a tick, of whole batches: medians over batches
  double ratio = 0;                              // median over pairs of batches of literal / fast; 0: no literal form
  double p50 = 0, p99 = 0, p999 = 0, worst = 0;  // of single ticks, all passes together
  double p99_of_medians = 0;                     // over the ticks, each the median of its passes
  double visited = 0;
  std::uint32_t most_visited = 0;
  std::uint64_t capped = 0;
  std::vector<double> passes_ns;  // mean_ns of each pass
};

// Both go over the same probes, batch by batch in turn: first for the means, then tick by tick for the percentiles.
TickCosts measure(const SolverScene& scene, const Walk& walk, SolverMethod method, int passes, double clock_ns) {
  const auto solver = makeProxySolver(method, scene.parameters);
  const bool has_literal = LiteralSolver::knows(method);
  LiteralSolver literal(*scene.whole, method, scene.parameters);
  SolverStep step;
  TickCosts costs;
  std::vector<double> fast, slow, ratios;
  const ProxyPlace start = scene.placeOn(walk.start);
  std::vector<std::vector<double>> ticks(walk.probes.size());
  const auto probeAt = [&](std::size_t i) { return ProbeState{walk.probes[i], 1e-3, walk.scale_um_m}; };
  double check = 0;
  for (int pass = 0; pass <= passes; ++pass) {  // the first one warms up
    solver->setPlace(start);
    literal.setPlace(start);
    for (std::size_t begin = 0; begin + kBatch <= walk.probes.size(); begin += kBatch) {
      const auto at = Clock::now();
      for (std::size_t i = begin; i < begin + kBatch; ++i) solver->advance(*scene.view, probeAt(i), step);
      const double fast_ns = nanoseconds(Clock::now() - at) / kBatch;
      double literal_ns = 0;
      if (has_literal) {
        const auto literal_at = Clock::now();
        for (std::size_t i = begin; i < begin + kBatch; ++i) literal.advance(walk.probes[i]);
        literal_ns = nanoseconds(Clock::now() - literal_at) / kBatch;
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
    for (std::size_t i = 0; i < walk.probes.size(); ++i) {
      const ProbeState probe = probeAt(i);
      const auto at = Clock::now();
      solver->advance(*scene.view, probe, step);
      const double ns = nanoseconds(Clock::now() - at);
      if (pass == 0) {
        costs.visited += step.visited;
        costs.most_visited = std::max(costs.most_visited, step.visited);
        costs.capped += step.capped;
      } else {
        ticks[i].push_back(std::max(0.0, ns - clock_ns));
      }
    }
  }
  if (check != 0 && costs.capped == 0)
    throw std::logic_error("the solver and its literal transcription part: the figures mean nothing");
  std::vector<double> each, single;
  for (const std::vector<double>& of_tick : ticks) {
    each.push_back(percentile(of_tick, 0.5));
    single.insert(single.end(), of_tick.begin(), of_tick.end());
  }
  costs.mean_ns = percentile(fast, 0.5);
  costs.literal_ns = has_literal ? percentile(slow, 0.5) : 0;
  costs.ratio = has_literal ? percentile(ratios, 0.5) : 0;
  costs.p50 = percentile(single, 0.5);
  costs.p99_of_medians = percentile(each, 0.99);
  costs.p99 = percentile(single, 0.99);
  costs.p999 = percentile(single, 0.999);
  costs.worst = percentile(single, 1.0);
  costs.visited /= static_cast<double>(walk.probes.size());
  return costs;
}

// Drives everything else out of the caches.
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

// Capped ticks only, each after a flush: from a random place towards a probe that sends the search far.
ColdCosts measureCold(const SolverScene& scene, SolverMethod method, int rounds, std::uint64_t seed, Flusher& flusher,
                      double clock_ns) {
  std::mt19937_64 random(seed);
  const auto solver = makeProxySolver(method, scene.parameters);
  SolverStep step;
  ColdCosts costs;
  for (int i = 0; i < rounds; ++i) {
    const std::size_t at = scene.anyOwned(random);
    solver->setPlace(scene.placeOn(at));
    const Vector3d away_W = 3e3 * cube(random);
    const ProbeState probe{scene.view->grid().toWorld(scene.owned[at].child) + away_W, 1e-3, 1e6 / 0.12};
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

Cell threadCell(std::uint32_t samples) {
  Cell cell = emptyCell("thread.swc");
  addSample(cell, Vector3d::Zero(), kNoParent);
  for (std::uint32_t i = 1; i < samples; ++i) addSample(cell, Vector3d(0.5 * i, i % 7 * 0.1, 0), i - 1);
  return cell;
}

BenchReport runSolver(const BenchOptions& options) {
  const double clock_ns = clockCost(wallNow_ns), thread_clock_ns = clockCost(threadNow_ns);
  const std::size_t ticks = options.quick ? 5000 : 20000;
  const int passes = options.quick ? 2 : kBatches;
  std::vector<SolverScene> scenes;
  options.progress("scenes");
  const std::size_t cells = options.quick ? 1 : 8;
  scenes.emplace_back("synthetic column", morphologyLibrary({}, cells, options.seed));
  if (!options.corpus.empty())
    scenes.emplace_back("real cells", morphologyLibrary(options.corpus, cells, options.seed));

  BenchReport report;
  BenchTable warm{"warm",
                  "one tick, caches warm, ns; literal: the paper's rules with recursion and hash sets over one flat "
                  "graph, on the same probes",
                  {"scene", "probe", "method", "segments mean", "most", "mean", "p50", "p99", "p99.9", "max",
                   "literal mean", "literal / this", "p99 of medians"},
                  {},
                  {"scene", "probe", "method"}};
  double least_ratio = 1e300, worst_p99 = 0;
  for (const SolverScene& scene : scenes) {
    std::vector<Walk> walks;
    walks.push_back(alongNeurites(scene, 0.125, 1.0, ticks, options.seed));
    walks.push_back(alongNeurites(scene, 1.25, 1.0, ticks / 2, options.seed));
    walks.push_back(alongNeurites(scene, 12.5, 1.0, ticks / 5, options.seed));
    walks.push_back(jumps(scene, std::max(ticks / 10, kBatch), options.seed));
    for (const Walk& walk : walks) {
      for (const SolverMethod method : kSolverMethods) {
        options.progress(scene.name + ", " + walk.name + ", " + toString(method));
        const TickCosts c = measure(scene, walk, method, passes, clock_ns);
        warm.rows.push_back({scene.name, walk.name, toString(method), c.visited, std::int64_t{c.most_visited},
                             c.mean_ns, c.p50, c.p99, c.p999, c.worst,
                             c.ratio > 0 ? BenchValue(c.literal_ns) : BenchValue("-"),
                             c.ratio > 0 ? BenchValue(c.ratio) : BenchValue("-"), c.p99_of_medians});
        report.samples.push_back({"warm", {scene.name, walk.name, toString(method)}, "mean", "ns", false, c.passes_ns});
        if (method == SolverMethod::force && &walk == &walks.front()) {
          least_ratio = std::min(least_ratio, c.ratio);
          worst_p99 = std::max(worst_p99, c.p99);
        }
      }
    }
  }
  report.tables.push_back(std::move(warm));

  options.progress("cold caches");
  scenes.emplace_back("hub of 10 000", std::vector<Cell>{hubCell(10000, options.seed)});
  scenes.emplace_back("comb of 200 000", std::vector<Cell>{combCell(options.quick ? 2000 : 200000)});
  scenes.emplace_back("thread of 1 000 000", std::vector<Cell>{threadCell(options.quick ? 2000 : 1000000)});
  Flusher flusher(options.quick ? 8u << 20 : 96u << 20);
  BenchTable cold{"cold",
                  "one tick of 200 to 256 segments, after everything was driven out of the caches, us",
                  {"scene", "method", "ticks", "p50", "p99", "max", "undo max"},
                  {},
                  {"scene", "method"}};
  double worst_cold_us = 0;
  for (const SolverScene& scene : scenes) {
    for (const SolverMethod method : kSolverMethods) {
      options.progress(scene.name + ", cold, " + toString(method));
      const ColdCosts c = measureCold(scene, method, options.quick ? 10 : 200, options.seed, flusher, thread_clock_ns);
      if (c.us.empty()) continue;
      const double p99 = percentile(c.us, 0.99);
      cold.rows.push_back({scene.name, toString(method), static_cast<std::int64_t>(c.us.size()), percentile(c.us, 0.5),
                           p99, percentile(c.us, 1.0), percentile(c.undo_us, 1.0)});
      worst_cold_us = std::max(worst_cold_us, p99);
    }
  }
  report.tables.push_back(std::move(cold));

  report.goals.push_back({"force-based tick, warm, hand at ordinary speed: literal / this", ">= 3", ">= 4", least_ratio,
                          least_ratio >= 3, least_ratio >= 4});
  report.goals.push_back({"force-based tick, warm, hand at ordinary speed: p99, ns", "<= 100", "<= 60", worst_p99,
                          worst_p99 <= 100, worst_p99 <= 60});
  report.goals.push_back({"capped tick, cold caches, worst scene and method: p99, us", "<= 50", "<= 25", worst_cold_us,
                          worst_cold_us <= 50, worst_cold_us <= 25});
  report.notes.push_back("Ordinary speed: 0.125 um a tick, 50 mm/s at 300 um across 12 cm.");
  report.notes.push_back(
      "Means: batches of " + std::to_string(kBatch) +
      " ticks under one pair of clock reads, this and literal in turn; medians over batches, the ratio over pairs.");
  report.notes.push_back("p50, p99, p99.9 and max are of single ticks, those of " + std::to_string(passes) +
                         " passes over the same probes together. The cost of reading the clock (" +
                         std::to_string(std::lround(clock_ns)) +
                         " ns) is subtracted. Interruptions by other programs are included. p99 of medians leaves them "
                         "out: each tick counts once, with the median of its passes.");
  report.notes.push_back(
      "Cold ticks cannot be repeated; they are in processor time of the thread, so that being put aside does not "
      "count, "
      "but what others do to the caches and the core does.");
  if (flusher.sum() == 0) report.notes.push_back("nothing was flushed");
  return report;
}

// The literal transcription recurses once a segment: on a long thread deeper than a usual stack, the more so when it is
// instrumented. So the workload has a thread with a stack of its own, of which only what is used is ever touched.
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
  all.push_back({"solver", "what a tick of each proxy solver costs, those of the paper beside a literal transcription",
                 runOnDeepStack});
}

}  // namespace filiform::tools
