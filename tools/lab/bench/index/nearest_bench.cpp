// bench nearest: the nearest segment of a set in memory, against other structures over the same segments: time, 99th
// percentile, build time and bytes, by the number of segments and by the place of the point.
#include "index/ingest/memory_tiles.h"
#include "index/query/nearest.h"
#include "index/tile/packed_tree.h"
#include "index/tile/tile_codec.h"
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/index/jump_race.h"
#include "tools/lab/bench/knee.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>

namespace filiform::tools {

namespace {

constexpr std::uint64_t kMostForPeers = 10'000'000;  // CGAL alone takes 19 GB at 1e8
const char* const kWhere[] = {"near", "uniform", "far"};

// CPU time, us, from a tile's bytes to its first query; median over tiles.
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

  BenchTable table{"jumps",
                   "An exact jump, everything in memory, at 0.67 segments a um^3: ns of CPU (median of batches), 99th "
                   "percentile by the clock, times that filiform is faster, share of right answers, tiles that "
                   "filiform searches",
                   {"segments", "points", "engine", "ns", "p99 ns", "times", "recall", "tiles"},
                   {},
                   {"segments", "points", "engine"}};
  BenchTable built{
      "built",
      "What it took: s until the whole can be searched; bytes a segment, by the growth of the process' "
      "resident memory, of all that answers need (with the segments as given, 48 bytes, where they are read); "
      "us until a tile can be queried",
      {"segments", "engine", "build s", "bytes", "tile ready us"},
      {},
      {"segments", "engine"}};
  BenchTable batches{
      "batches",
      "Batches of points, everything in memory: ns by the clock a point (median of batches), for one call "
      "a point in random order, and for findAll() on one and on two threads",
      {"segments", "points", "single ns", "one thread ns", "two threads ns", "one faster", "two faster"},
      {},
      {"segments", "points"}};
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
    OwnEngine own(cells, size);
    const TileStore& store = own.store();
    const Nearest& nearest = own.nearest();
    std::vector<JumpEngine> engines{own.engine()};
    std::optional<WholeEngine> whole;
    std::vector<SegmentEnds> ends;
    if (size <= kMostForPeers) {
      options.progress("one tree of " + n);
      DenseCells again(library, size, kPerUm3, options.seed);
      engines.push_back(whole.emplace(again, size).engine());
      ends = ownedEnds(store);
      for (const Peer& peer : peers()) {
        if (!peer.inBuild()) continue;
        options.progress(peer.name + "'s tree of " + n);
        engines.push_back(builtEngine(peer.name, peer.best(), ends));
      }
    }
    const double ready_now_us = ready_us(store);
    ready.x.push_back(static_cast<double>(size)), ready.y.push_back(ready_now_us);
    for (std::size_t w = 0; w < std::size(kWhere); ++w) {
      const std::string where = kWhere[w];
      options.progress("jumps through " + n + ", " + where);
      const std::size_t count = options.quick ? 100 : 5000;
      const std::vector<Vector3d> points = pointsOf(store, where, count, side_um, options.seed + 1);
      const std::vector<Raced> raced = raceJumps(engines, points);
      double tiles = 0;
      std::vector<NearestResult> found;
      for (const Vector3d& h_W : points) tiles += nearest.find(h_W, {}, found).tiles_searched;
      const double own_ns = percentile(raced[0].ns, 0.5);
      for (std::size_t e = 0; e < engines.size(); ++e) {
        const double ns = percentile(raced[e].ns, 0.5);
        table.rows.push_back({static_cast<std::int64_t>(size), where, engines[e].name, ns, raced[e].p99_ns, ns / own_ns,
                              raced[e].recall,
                              e == 0 ? BenchValue(tiles / static_cast<double>(count)) : BenchValue(std::string("-"))});
        report.samples.push_back(
            {"jumps", {static_cast<std::int64_t>(size), where, engines[e].name}, "ns", "ns", false, raced[e].ns});
        put(curves[w], engines[e].name, static_cast<double>(size), ns);
        if (size != largest || where == "far") continue;
        if (engines[e].name == "whole")
          report.goals.push_back({"warm exact jump, " + where + ", times the time of one tree over all",
                                  "<= " + shown(where == "near" ? 1.2 : 1.3), "<= 1.1", own_ns / ns,
                                  own_ns / ns <= (where == "near" ? 1.2 : 1.3), own_ns / ns <= 1.1});
        if (engines[e].name == "CGAL") report.goals.push_back(timesFaster("one CGAL tree", where, ns / own_ns, 3, 5));
        if (engines[e].name == "Boost") report.goals.push_back(timesFaster("Boost", where, ns / own_ns, 1.1, 2));
        if (engines[e].name == "Embree") report.goals.push_back(timesFaster("Embree 3", where, ns / own_ns, 0.8, 1.5));
      }
    }
    for (std::size_t w = 0; size == largest && w < 2; ++w) {
      options.progress(std::string("batches through ") + n + ", " + kWhere[w]);
      const RacedBatches raced =
          raceBatches(nearest, pointsOf(store, kWhere[w], options.quick ? 1000 : 100'000, side_um, options.seed + 2));
      const double single = percentile(raced.single, 0.5), one = percentile(raced.one_thread, 0.5),
                   two = percentile(raced.two_threads, 0.5);
      batches.rows.push_back(
          {static_cast<std::int64_t>(size), std::string(kWhere[w]), single, one, two, single / one, one / two});
      report.goals.push_back({std::string("a batch on one thread, ") + kWhere[w] + ", times faster than single calls",
                              ">= 1.6", ">= 2.5", single / one, single / one >= 1.6, single / one >= 2.5});
      report.goals.push_back({std::string("a batch on two threads, ") + kWhere[w] + ", times faster than on one",
                              ">= 1.9", ">= 1.9", one / two, one / two >= 1.9, one / two >= 1.9});
    }
    for (const JumpEngine& engine : engines) {
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
  report.tables.push_back(std::move(batches));
  std::string absent;
  for (const Peer& peer : peers()) {
    if (peer.inBuild())
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
      "Batches of the engines alternate; each answer is compared with filiform's before its time counts. p99: of "
      "single "
      "jumps, reading the clock included. FLANN and nanoflann search points: middles of pieces of segments, each "
      "refined "
      "to its segment. Whole: filiform's tree over all segments in one piece, without tiles. Beyond 1e7 segments "
      "filiform runs alone.");
  std::string settings;
  for (const Peer& peer : peers())
    if (peer.inBuild()) settings += (settings.empty() ? "" : "; ") + peer.name + ": " + peer.best().name;
  if (!settings.empty())
    report.notes.push_back("Settings, the best of those that `filiform bench peers` searches: " + settings + ".");
  return report;
}

}  // namespace

void addNearestWorkloads(std::vector<Workload>& all) {
  all.push_back({"nearest", "exact jumps against CGAL, Boost, Embree, FLANN and nanoflann, by the number of segments",
                 runNearest});
}

}  // namespace filiform::tools
