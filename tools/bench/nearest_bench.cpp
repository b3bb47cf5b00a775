// bench nearest: the nearest segment of a set in memory against other structures over the same segments: time, tail,
// building, bytes, by the number of segments and by where the point lies.
#include "index/memory_tiles.h"
#include "index/nearest.h"
#include "index/packed_tree.h"
#include "index/tile_codec.h"
#include "tools/bench/dense_cells.h"
#include "tools/bench/knee.h"
#include "tools/bench/peers.h"
#include "tools/bench/trade.h"
#include "tools/bench/workloads.h"

#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <malloc.h>
#include <memory>
#include <random>
#include <string>
#include <unistd.h>

namespace filiform::tools {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSame_um = 1e-6;
constexpr std::uint64_t kMostForPeers = 10'000'000;  // CGAL alone takes 19 GB at 1e8
const char* const kWhere[] = {"near", "uniform", "far"};

double resident_bytes() {
  malloc_trim(0);  // what was freed is no one's
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

struct Engine {
  std::string name;
  SquaredDistance squared;
  double build_s = 0, bytes = 0;  // bytes a segment
};

template <typename Build>
void timeBuild(Engine& engine, double segments, Build&& build) {
  const double before = resident_bytes(), from = threadTime_s();
  const auto start = Clock::now();
  build();
  // Embree builds on threads of its own: the clock sees them.
  engine.build_s = std::max(threadTime_s() - from, std::chrono::duration<double>(Clock::now() - start).count());
  engine.bytes = (resident_bytes() - before) / segments;
}

// Every segment once, as the peers take them.
std::vector<SegmentEnds> ownedEnds(const TileStore& store) {
  std::vector<SegmentEnds> ends;
  for (TileId id = 0; id < store.tile_count(); ++id) {
    const auto tile = store.load(id);
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
      if (tile->owned(s)) ends.push_back({tile->position_W(tile->child(s)), tile->position_W(tile->parent(s))});
  }
  return ends;
}

std::vector<Vector3d> pointsOf(const TileStore& store, const std::string& where, std::size_t count, double side_um,
                               std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, side_um), around(-side_um, 2 * side_um);
  std::normal_distribution<double> jitter(0, 0.5);
  std::vector<Vector3d> points;
  while (points.size() < count) {
    if (where == "near") {
      const auto tile = store.load(static_cast<TileId>(random() % store.tile_count()));
      if (tile->node_count() == 0) continue;
      points.push_back(tile->position_W(static_cast<std::uint32_t>(random() % tile->node_count())) +
                       Vector3d(jitter(random), jitter(random), jitter(random)));
    } else if (where == "uniform") {
      points.emplace_back(place(random), place(random), place(random));
    } else {
      const Vector3d h_W(around(random), around(random), around(random));
      if ((h_W.array() < 0).any() || (h_W.array() > side_um).any()) points.push_back(h_W);
    }
  }
  return points;
}

struct Raced {
  std::vector<double> ns;  // a query, by batch
  double p99_ns = 0, recall = 0;
};

// Alternating batches in processor time of the thread; then each query by itself for the tail. Throws when an engine is
// wrong by more than rounding.
std::vector<Raced> race(const std::vector<Engine>& engines, const std::vector<Vector3d>& points) {
  std::vector<double> expected, found(points.size());
  std::vector<Raced> all(engines.size());
  for (const Vector3d& h_W : points) expected.push_back(std::sqrt(engines[0].squared(h_W)));  // and warms up
  for (int batch = 0; batch < kBatches; ++batch)
    for (std::size_t e = 0; e < engines.size(); ++e) {
      const double from = threadTime_s();
      for (std::size_t i = 0; i < points.size(); ++i) found[i] = engines[e].squared(points[i]);
      all[e].ns.push_back(1e9 * (threadTime_s() - from) / static_cast<double>(points.size()));
      for (std::size_t i = 0; batch == 0 && i < points.size(); ++i) {
        const double off_um = std::abs(std::sqrt(found[i]) - expected[i]);
        if (!(off_um <= kSame_um)) throw std::runtime_error(engines[e].name + " answers otherwise than filiform");
        all[e].recall += 1.0 / static_cast<double>(points.size());
      }
    }
  for (std::size_t e = 0; e < engines.size(); ++e) {
    std::vector<double> single;
    for (const Vector3d& h_W : points) {
      const auto start = Clock::now();
      found[0] = engines[e].squared(h_W);
      single.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count());
    }
    all[e].p99_ns = percentile(single, 0.99);
  }
  return all;
}

// us of CPU from a tile's bytes to its first query, median over tiles.
double ready_us(const TileStore& store) {
  std::vector<double> us;
  const TileId step = std::max<TileId>(1, store.tile_count() / 48);
  for (TileId id = 0; id < store.tile_count(); id += step) {
    if (id == store.long_tile()) continue;
    const auto tile = store.load(id);
    const std::vector<std::uint8_t> bytes = encodeTile(*tile);
    const TilePlace place{id, tile->key(), tile->isLong(), "memory", 0};
    for (int again = 0; again < 3; ++again) {
      const double from = threadTime_s();
      const auto tree = makePackedTree(std::make_shared<const Tile>(decodeTile(bytes, place, store.grid())));
      Candidates best(1, 0, std::numeric_limits<double>::infinity());
      tree->search(tile->position_W(0), best);
      us.push_back(1e6 * (threadTime_s() - from));
    }
  }
  return percentile(us, 0.5);
}

BenchGoal timesFaster(const std::string& peer, const std::string& where, double ratio, double must, double aim) {
  return {"warm exact jump, " + where + ", times faster than " + peer,
          ">= " + shown(must),
          ">= " + shown(aim),
          ratio,
          ratio >= must,
          ratio >= aim};
}

BenchReport runNearest(const BenchOptions& options) {
  BenchReport report;
  const std::uint64_t largest = options.segments != 0 ? options.segments
                                : options.quick       ? 20'000
                                : options.long_run    ? 100'000'000
                                                      : 1'000'000;
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t n = options.quick ? 10'000 : 100'000; n < largest; n *= 10) {
    sizes.push_back(n);
    if (3 * n < largest) sizes.push_back(3 * n);
  }
  sizes.push_back(largest);
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  if (library.empty()) throw std::runtime_error("no reconstruction below " + options.corpus + " can be used");

  BenchTable table{"jumps",
                   "An exact jump, everything in memory, at 0.67 segments a um^3: ns of CPU (median of batches), 99th "
                   "percentile by the clock, times that filiform is faster, share of right answers, tiles that "
                   "filiform searches",
                   {"segments", "points", "engine", "ns", "p99 ns", "times", "recall", "tiles"},
                   {}};
  BenchTable built{"built",
                   "What it took: s until the whole can be searched, bytes a segment in memory beside the segments as "
                   "they were given (filiform: tiles with their trees, nothing else), us until a tile can be queried",
                   {"segments", "engine", "build s", "bytes", "tile ready us"},
                   {}};
  std::vector<std::vector<PlotSeries>> curves(std::size(kWhere));
  std::vector<PlotSeries> bytes_curve;
  PlotSeries ready{"a tile ready", {}, {}};
  const auto put = [](std::vector<PlotSeries>& all, const std::string& name, double x, double y) {
    for (PlotSeries& one : all)
      if (one.name == name) {
        one.x.push_back(x), one.y.push_back(y);
        return;
      }
    all.push_back({name, {x}, {y}});
  };
  for (const std::uint64_t size : sizes) {
    const std::string n = std::to_string(size) + " segments";
    options.progress("tiles of " + n);
    DenseCells cells(library, size, kPerUm3, options.seed);
    const double side_um = cells.side_um();
    std::vector<Engine> engines(1);
    engines[0].name = "filiform";
    std::unique_ptr<TileStore> store;
    std::unique_ptr<Nearest> nearest;
    const double from = threadTime_s();
    store = buildTilesInMemory(cells);
    nearest = std::make_unique<Nearest>(*store, NearestOptions{.budget_bytes = UINT64_MAX});
    for (TileId id = 0; id < store->tile_count(); ++id) {
      const auto tile = store->load(id);
      nearest->find(tile->position_W(0));
    }
    engines[0].build_s = threadTime_s() - from;
    engines[0].squared = [&nearest](const Vector3d& h_W) {
      const double d = nearest->find(h_W)[0].distance_um;
      return d * d;
    };
    std::vector<SegmentEnds> ends;
    if (size <= kMostForPeers) {
      ends = ownedEnds(*store);
      for (const Peer& peer : peers()) {
        if (!peer.build) continue;
        options.progress(peer.name + "'s tree of " + n);
        Engine engine{peer.name, {}};
        timeBuild(engine, static_cast<double>(ends.size()), [&] { engine.squared = peer.build(ends); });
        engines.push_back(std::move(engine));
      }
    }
    const double ready_now_us = ready_us(*store);
    ready.x.push_back(static_cast<double>(size)), ready.y.push_back(ready_now_us);
    for (std::size_t w = 0; w < std::size(kWhere); ++w) {
      const std::string where = kWhere[w];
      options.progress("jumps through " + n + ", " + where);
      const std::size_t count = options.quick ? 100 : 5000;
      const std::vector<Vector3d> points = pointsOf(*store, where, count, side_um, options.seed + 1);
      const std::vector<Raced> raced = race(engines, points);
      double tiles = 0;
      for (const Vector3d& h_W : points) tiles += nearest->find(h_W).at(0).tiles_searched;
      const double own_ns = percentile(raced[0].ns, 0.5);
      for (std::size_t e = 0; e < engines.size(); ++e) {
        const double ns = percentile(raced[e].ns, 0.5);
        table.rows.push_back({static_cast<std::int64_t>(size), where, engines[e].name, ns, raced[e].p99_ns, ns / own_ns,
                              raced[e].recall,
                              e == 0 ? BenchValue(tiles / static_cast<double>(count)) : BenchValue(std::string("-"))});
        report.samples.push_back({"jump, " + n + ", " + where + ", " + engines[e].name, "ns", false, raced[e].ns});
        put(curves[w], engines[e].name, static_cast<double>(size), ns);
        if (size != largest || where == "far") continue;
        if (engines[e].name == "CGAL") report.goals.push_back(timesFaster("one CGAL tree", where, ns / own_ns, 3, 5));
        if (engines[e].name == "Boost") report.goals.push_back(timesFaster("Boost", where, ns / own_ns, 1.1, 2));
        if (engines[e].name == "Embree") report.goals.push_back(timesFaster("Embree 3", where, ns / own_ns, 0.8, 1.5));
      }
    }
    engines[0].bytes = static_cast<double>(nearest->bytes()) / static_cast<double>(size);  // all tiles were met
    for (const Engine& engine : engines) {
      built.rows.push_back({static_cast<std::int64_t>(size), engine.name, engine.build_s, engine.bytes,
                            &engine == &engines[0] ? BenchValue(ready_now_us) : BenchValue(std::string("-"))});
      put(bytes_curve, engine.name, static_cast<double>(size), engine.bytes);
    }
  }
  for (std::size_t w = 0; w < std::size(kWhere); ++w) {
    BenchCurve curve = tradeCurve(std::string("jump_") + kWhere[w],
                                  std::string("An exact jump, ") + kWhere[w] + ", against the number of segments",
                                  "segments", "CPU a jump (ns)", curves[w], true, true);
    curve.finding = "filiform grows as N^" + shown(logSlope(curves[w][0].x, curves[w][0].y)) + ", expected log N";
    for (std::size_t e = 1; e < curves[w].size(); ++e) {
      curve.finding += e == 1 ? "; at the largest size the time of " : ", of ";
      curve.finding +=
          curves[w][e].name + " is " + shown(curves[w][e].y.back() / curves[w][0].y.back()) + " times as long";
    }
    curve.finding += ".";
    report.curves.push_back(std::move(curve));
  }
  BenchCurve bytes = tradeCurve("bytes", "Memory of the whole, against the number of segments", "segments",
                                "bytes a segment", bytes_curve, true, true);
  bytes.finding = "filiform takes " + shown(bytes_curve[0].y.back()) +
                  " bytes a segment with everything in memory, and needs a part of that only; others hold all.";
  report.curves.push_back(std::move(bytes));
  BenchCurve ready_curve =
      tradeCurve("ready", "A tile ready for its first query, against the number of segments", "segments", "CPU (us)",
                 {ready, lawSeries("N^0", ready.x, ready.y[0], 0)}, true, true);
  ready_curve.finding = "Exponent " + shown(logSlope(ready.x, ready.y)) +
                        ", expected 0: a tile has one capacity, however many there are.";
  report.curves.push_back(std::move(ready_curve));
  report.tables.push_back(std::move(table));
  report.tables.push_back(std::move(built));
  std::string absent;
  for (const Peer& peer : peers()) {
    if (peer.build)
      report.versions.emplace_back(peer.name, peer.version);
    else
      absent += (absent.empty() ? "" : ", ") + peer.name;
  }
  if (!absent.empty())
    report.notes.push_back("Not in this build: " + absent + " (tools/setup --bench, then configure and build again).");
  report.notes.push_back(options.corpus.empty() ? "Synthetic neurons; --corpus DIR takes real ones."
                                                : std::to_string(library.size()) + " real reconstructions.");
  report.notes.push_back(
      "Near: 0.5 um (sigma, each axis) about a node; uniform: in the cube; far: within one side of the cube about it. "
      "Batches of the engines alternate; each answer is compared with filiform's before its time counts. FLANN and "
      "nanoflann search points: middles of pieces of at most 4 um, each refined to its segment. Beyond 1e7 segments "
      "filiform runs alone.");
  return report;
}

}  // namespace

void addNearestWorkloads(std::vector<Workload>& all) {
  all.push_back({"nearest", "exact jumps against CGAL, Boost, Embree, FLANN and nanoflann, by the number of segments",
                 runNearest});
}

}  // namespace filiform::tools
