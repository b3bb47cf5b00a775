// filiform bench index: the packed tree and jumps through tiles, against one CGAL tree and other structures over the
// same segments.
#include "index/memory_tiles.h"
#include "index/nearest.h"
#include "index/packed_tree.h"
#include "index/reference_tree.h"
#include "index/tile_codec.h"
#include "tools/bench/dense_cells.h"
#include "tools/bench/midpoint_peers.h"
#include "tools/bench/trade.h"
#include "tools/bench/workloads.h"

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/version.h>

#if __has_include(<boost/geometry/index/rtree.hpp>)
#define FILIFORM_BENCH_BOOST 1
#define BOOST_ALLOW_DEPRECATED_HEADERS  // it includes such
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/version.hpp>
#endif

namespace filiform::tools {

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using CgalSegments = std::vector<Kernel::Segment_3>;
using CgalTree =
    CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_segment_primitive<Kernel, CgalSegments::iterator>>>;

constexpr int kBatches = 5;

template <typename Work>
double seconds(Work&& work) {
  const double from = threadTime_s();
  work();
  return threadTime_s() - from;
}

Kernel::Point_3 cgalPoint(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// The owned segments. CGAL takes none of length zero: samples without links get a length that cannot be told from it.
void appendSegments(const Tile& tile, bool ghosts, CgalSegments& segments) {
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!ghosts && !tile.owned(s)) continue;
    const Vector3d a_W = tile.position_W(tile.child(s));
    Vector3d b_W = tile.position_W(tile.parent(s));
    if (a_W == b_W) b_W.x() += 1e-9;
    segments.emplace_back(cgalPoint(a_W), cgalPoint(b_W));
  }
}

Vector3d nearPoint(const Tile& tile, std::mt19937_64& random) {
  std::normal_distribution<double> jitter(0, 0.5);
  return tile.position_W(static_cast<std::uint32_t>(random() % tile.node_count())) +
         Vector3d(jitter(random), jitter(random), jitter(random));
}

// A competitor in a batch: answers the squared distance.
struct Engine {
  std::string name;
  std::function<double(const Vector3d&)> squared;
  std::vector<double> ns;  // of a query, by batch
};

// Alternating batches; the median counts. Throws when two engines disagree by more than rounding.
void race(std::vector<Engine>& engines, const std::vector<Vector3d>& points) {
  std::vector<double> expected;
  for (int batch = 0; batch < kBatches; ++batch)
    for (Engine& engine : engines) {
      std::vector<double> found;
      found.reserve(points.size());
      const double took = seconds([&] {
        for (const Vector3d& h_W : points) found.push_back(engine.squared(h_W));
      });
      engine.ns.push_back(1e9 * took / static_cast<double>(points.size()));
      if (expected.empty()) expected = found;
      for (std::size_t i = 0; i < found.size(); ++i)
        if (std::abs(std::sqrt(found[i]) - std::sqrt(expected[i])) > 1e-6)
          throw std::runtime_error(engine.name + " answers otherwise than " + engines[0].name);
    }
}

double median(const std::vector<double>& values) { return percentile(values, 0.5); }

struct InTiles {
  double stored_per_tile = 0, tile_bytes = 0, tree_bytes = 0, disk_bytes = 0;  // a stored segment
  double ready_us = 0, cgal_ready_us = 0;                                      // a tile
  double packed_ns = 0, portable_ns = 0, cgal_ns = 0;                          // a query, near
};

InTiles measureTiles(const TileStore& store, std::uint64_t seed) {
  InTiles sum;
  std::mt19937_64 random(seed);
  std::vector<double> ready, cgal_ready;
  std::vector<double> packed_ns, portable_ns, cgal_ns;
  const TileId step = std::max<TileId>(1, store.tile_count() / 24);
  std::size_t segments = 0, tiles = 0;
  for (TileId id = 0; id < store.tile_count(); id += step) {
    if (id == store.long_tile()) continue;
    const std::shared_ptr<const Tile> tile = store.load(id);
    if (tile->segment_count() < 16) continue;
    const std::vector<std::uint8_t> bytes = encodeTile(*tile);
    const TilePlace place{id, tile->key(), tile->isLong(), "memory", 0};
    std::unique_ptr<TileEngine> packed;
    CgalSegments ends;
    appendSegments(*tile, true, ends);
    std::unique_ptr<CgalTree> cgal;
    for (int batch = 0; batch < kBatches; ++batch) {
      ready.push_back(1e6 * seconds([&] {
                        packed = makePackedTree(std::make_shared<const Tile>(decodeTile(bytes, place, store.grid())));
                      }));
      cgal.reset();
      cgal_ready.push_back(1e6 * seconds([&] {
                             cgal = std::make_unique<CgalTree>(ends.begin(), ends.end());
                             cgal->build();
                             cgal->accelerate_distance_queries();
                           }));
    }
    segments += tile->segment_count();
    ++tiles;
    sum.tile_bytes += static_cast<double>(tile->bytes());
    sum.tree_bytes += static_cast<double>(packed->bytes());
    sum.disk_bytes += static_cast<double>(bytes.size());

    std::vector<Vector3d> points;
    for (int i = 0; i < 200; ++i) points.push_back(nearPoint(*tile, random));
    const auto portable = makePackedTree(tile, "portable");
    const auto search = [](const TileEngine& engine, const Vector3d& h_W) {
      Candidates best(1, 0, std::numeric_limits<double>::infinity());
      engine.search(h_W, best);
      return best.bound2();
    };
    std::vector<Engine> engines{
        {"packed", [&](const Vector3d& h_W) { return search(*packed, h_W); }, {}},
        {"portable", [&](const Vector3d& h_W) { return search(*portable, h_W); }, {}},
        {"CGAL", [&](const Vector3d& h_W) { return cgal->squared_distance(cgalPoint(h_W)); }, {}}};
    race(engines, points);
    packed_ns.push_back(median(engines[0].ns));
    portable_ns.push_back(median(engines[1].ns));
    cgal_ns.push_back(median(engines[2].ns));
  }
  const auto n = static_cast<double>(std::max<std::size_t>(segments, 1));
  sum.stored_per_tile = n / static_cast<double>(std::max<std::size_t>(tiles, 1));
  sum.tile_bytes /= n, sum.tree_bytes /= n, sum.disk_bytes /= n;
  sum.ready_us = median(ready), sum.cgal_ready_us = median(cgal_ready);
  sum.packed_ns = median(packed_ns), sum.portable_ns = median(portable_ns), sum.cgal_ns = median(cgal_ns);
  return sum;
}

std::unique_ptr<TileStore> build(const std::vector<Cell>& library, std::uint64_t segments, double per_um3,
                                 std::uint32_t capacity, std::uint64_t seed, double* side_um = nullptr) {
  DenseCells cells(library, segments, per_um3, seed);
  if (side_um != nullptr) *side_um = cells.side_um();
  return buildTilesInMemory(cells, {.capacity = capacity});
}

struct Jumps {
  std::vector<Engine> engines;
  double tiles = 0;  // searched by an exact jump
};

// `others`: what else to race, over the same segments.
Jumps measureJumps(const TileStore& store, const std::vector<Engine>& others, bool near, std::size_t count,
                   double side_um, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, side_um);
  std::vector<Vector3d> points;
  while (points.size() < count) {
    const std::shared_ptr<const Tile> tile = store.load(static_cast<TileId>(random() % store.tile_count()));
    points.push_back(near ? nearPoint(*tile, random) : Vector3d(place(random), place(random), place(random)));
  }
  const Nearest nearest(store, {.budget_bytes = UINT64_MAX});
  Jumps jumps;
  for (const Vector3d& h_W : points) jumps.tiles += nearest.find(h_W).at(0).tiles_searched;  // and warms up
  jumps.tiles /= static_cast<double>(count);
  jumps.engines.push_back({"filiform",
                           [&](const Vector3d& h_W) {
                             const double d = nearest.find(h_W)[0].distance_um;
                             return d * d;
                           },
                           {}});
  for (const Engine& other : others) jumps.engines.push_back(other);
  race(jumps.engines, points);
  return jumps;
}

BenchGoal atLeast(const std::string& what, double must, double aim, double measured) {
  const auto text = [](double x) {
    std::string s = std::to_string(x);
    s.erase(s.find_last_not_of('0') + 1);
    if (s.back() == '.') s.pop_back();
    return s;
  };
  return {what, ">= " + text(must), ">= " + text(aim), measured, measured >= must, measured >= aim};
}
BenchGoal atMost(const std::string& what, double must, double aim, double measured) {
  BenchGoal goal = atLeast(what, must, aim, measured);
  goal.must.replace(0, 2, "<="), goal.aim.replace(0, 2, "<=");
  goal.met_must = measured <= must, goal.met_aim = measured <= aim;
  return goal;
}

BenchReport runIndex(const BenchOptions& options) {
  BenchReport report;
  report.versions.emplace_back("CGAL", CGAL_VERSION_STR);
  const std::uint64_t in_tiles = options.quick ? 20000 : options.long_run ? 300000 : 100000;
  const std::uint64_t all = options.quick ? 20000 : options.segments != 0 ? options.segments : 1000000;
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  if (library.empty()) throw std::runtime_error("no reconstruction below " + options.corpus + " can be used");
  report.notes.push_back(options.corpus.empty() ? "Synthetic neurons; --corpus DIR takes real ones."
                                                : std::to_string(library.size()) + " real reconstructions.");
  std::string paths;
  for (const std::string& path : packedTreePaths()) paths += (paths.empty() ? "" : ", ") + path;
  report.notes.push_back("Paths of the packed tree on this machine: " + paths + "; the last is used.");
  report.notes.push_back(
      "Near: 0.5 um (sigma, each axis) about a node. Batches of the engines alternate; medians, in processor time of "
      "the thread. Answers are compared.");

  BenchTable tiles{
      "tiles",
      "One tile: stored segments, bytes a stored segment, us until it can be queried once its bytes are in "
      "memory, ns a near query",
      {"per_um3", "capacity", "stored", "tile_bytes", "tree_bytes", "disk_bytes", "ready_us", "cgal_ready_us",
       "ready_ratio", "packed_ns", "portable_ns", "cgal_ns", "query_ratio", "tiles_near", "tiles_uniform"},
      {}};
  for (const double per_um3 : {0.67, 2.1})
    for (const std::uint32_t capacity : {2048u, 4096u, 8192u, 16384u}) {
      if (options.quick && capacity != 4096) continue;
      options.progress("tiles at " + std::to_string(per_um3) + " a um^3, capacity " + std::to_string(capacity));
      double side_um = 0;
      const auto store = build(library, in_tiles, per_um3, capacity, options.seed, &side_um);
      const InTiles m = measureTiles(*store, options.seed);
      const std::size_t count = options.quick ? 100 : 2000;
      const double near = measureJumps(*store, {}, true, count, side_um, options.seed).tiles;
      const double uniform = measureJumps(*store, {}, false, count, side_um, options.seed).tiles;
      tiles.rows.push_back({per_um3, std::int64_t{capacity}, m.stored_per_tile, m.tile_bytes, m.tree_bytes,
                            m.disk_bytes, m.ready_us, m.cgal_ready_us, m.cgal_ready_us / m.ready_us, m.packed_ns,
                            m.portable_ns, m.cgal_ns, m.cgal_ns / m.packed_ns, near, uniform});
      if (capacity != 4096) continue;
      const std::string at = ", " + std::string(per_um3 < 1 ? "0.67" : "2.1") + " segments a um^3";
      report.goals.push_back(
          atMost("bytes a stored segment in memory, with the packed tree" + at, 20, 12, m.tile_bytes + m.tree_bytes));
      report.goals.push_back(
          atLeast("tile of 4096 queryable, against CGAL" + at, 25, 80, m.cgal_ready_us / m.ready_us));
      report.goals.push_back(atLeast("query in a tile, near, against CGAL" + at, 3.5, 6, m.cgal_ns / m.packed_ns));
      report.goals.push_back(atMost("tiles opened by an exact jump, near" + at, 1.5, 1.2, near));
      report.goals.push_back(atMost("tiles opened by an exact jump, uniform" + at, 2.2, 2, uniform));
    }
  report.tables.push_back(std::move(tiles));

  options.progress("jumps through " + std::to_string(all) + " segments");
  double side_um = 0;
  const auto store = build(library, all, 0.67, 4096, options.seed, &side_um);
  CgalSegments segments;
  for (TileId t = 0; t < store->tile_count(); ++t) appendSegments(*store->load(t), false, segments);
  CgalTree cgal(segments.begin(), segments.end());
  cgal.build();
  cgal.accelerate_distance_queries();
  std::vector<Engine> others{{"CGAL", [&](const Vector3d& h_W) { return cgal.squared_distance(cgalPoint(h_W)); }, {}}};
#ifdef FILIFORM_BENCH_BOOST
  namespace bg = boost::geometry;
  using Point = bg::model::point<double, 3, bg::cs::cartesian>;
  using Segment = bg::model::segment<Point>;
  std::vector<Segment> packed;
  packed.reserve(segments.size());
  for (const Kernel::Segment_3& s : segments)
    packed.emplace_back(Point(s.source().x(), s.source().y(), s.source().z()),
                        Point(s.target().x(), s.target().y(), s.target().z()));
  const bg::index::rtree<Segment, bg::index::linear<16>> boost_tree(packed);
  packed = {};
  others.push_back({"Boost",
                    [&](const Vector3d& h_W) {
                      const Point p(h_W.x(), h_W.y(), h_W.z());
                      double squared = 0;
                      for (auto it = boost_tree.qbegin(bg::index::nearest(p, 1)); it != boost_tree.qend(); ++it)
                        squared = bg::comparable_distance(p, *it);
                      return squared;
                    },
                    {}});
  report.versions.emplace_back("Boost", BOOST_LIB_VERSION);
#else
  report.notes.push_back("Boost.Geometry was not there when this was built.");
#endif
  std::vector<SegmentEnds> ends;
  const EmbreePeer embree = [&] {
    ends.reserve(segments.size());
    for (const Kernel::Segment_3& s : segments)
      ends.push_back({Vector3d(s.source().x(), s.source().y(), s.source().z()),
                      Vector3d(s.target().x(), s.target().y(), s.target().z())});
    return embreePeer(ends);
  }();
  if (embree.squared) {
    others.push_back({"Embree", embree.squared, {}});
    report.versions.emplace_back("Embree", embree.version);
  } else {
    report.notes.push_back("Without Embree: configure with -DFILIFORM_BENCH_PEERS=ON after tools/setup --bench.");
  }
  for (const PointPeer& peer : midpointPeers(ends)) {
    others.push_back({peer.name, peer.squared, {}});
    report.versions.emplace_back(peer.name, peer.version);
  }
  BenchTable jumps{"jumps",
                   "An exact jump, warm, " + std::to_string(segments.size()) +
                       " segments at 0.67 a um^3, capacity 4096: ns, and how many times filiform is faster",
                   {"points", "engine", "ns", "ratio", "tiles"},
                   {}};
  for (const bool near : {true, false}) {
    const std::string points = near ? "near" : "uniform";
    Jumps m = measureJumps(*store, others, near, options.quick ? 200 : 20000, side_um, options.seed + 1);
    const double own = median(m.engines[0].ns);
    for (const Engine& engine : m.engines) {
      const double ratio = median(engine.ns) / own;
      jumps.rows.push_back({points, engine.name, median(engine.ns), ratio,
                            engine.name == "filiform" ? BenchValue(m.tiles) : BenchValue(std::string("-"))});
      report.samples.push_back({"jump, " + points + ", " + engine.name, "ns", false, engine.ns});
      if (engine.name == "CGAL")
        report.goals.push_back(atLeast("warm exact jump, " + points + ", against one CGAL tree", 3, 5, ratio));
      if (engine.name == "Boost")
        report.goals.push_back(atLeast("warm exact jump, " + points + ", against Boost rtree", 1.1, 2, ratio));
      if (engine.name == "Embree")
        report.goals.push_back(atLeast("warm exact jump, " + points + ", against Embree 3", 0.8, 1.5, ratio));
    }
  }
  report.tables.push_back(std::move(jumps));
  report.notes.push_back("The goals of jumps are stated for 1e7 segments: --segments 10000000 (about 6 GB).");
  return report;
}

}  // namespace

void addIndexWorkloads(std::vector<Workload>& all) {
  all.push_back(
      {"index", "tiles in memory and exact jumps, against CGAL, Boost, Embree, FLANN and nanoflann", runIndex});
}

}  // namespace filiform::tools
