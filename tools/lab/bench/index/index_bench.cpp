// bench index: tiles in memory, by density and capacity: bytes, time until the first query, time of a query, and tiles
// that an exact jump opens.
#include "index/ingest/memory_tiles.h"
#include "index/query/nearest.h"
#include "index/tile/packed_tree.h"
#include "index/tile/reference_tree.h"
#include "index/tile/tile_codec.h"
#include "tools/lab/bench/index/box_peers.h"
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>

namespace filiform::tools {

namespace {

template <typename Work>
double seconds(Work&& work) {
  const double from = threadTime_s();
  work();
  return threadTime_s() - from;
}

Vector3d nearPoint(const Tile& tile, std::mt19937_64& random) {
  std::normal_distribution<double> jitter(0, 0.5);
  return tile.position_W(static_cast<std::uint32_t>(random() % tile.node_count())) +
         Vector3d(jitter(random), jitter(random), jitter(random));
}

// An engine in a batch. Returns the squared distance.
struct TreeEngine {
  std::string name;
  std::function<double(const Vector3d&)> squared;
  std::vector<double> ns;  // of a query, by batch
};

// Runs batches of the engines in turn; the median counts. Throws if two engines differ by more than rounding.
void race(std::vector<TreeEngine>& engines, const std::vector<Vector3d>& points) {
  std::vector<double> expected;
  for (int batch = 0; batch < kBatches; ++batch)
    for (TreeEngine& engine : engines) {
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

struct InTiles {
  double stored_per_tile = 0, tile_bytes = 0, tree_bytes = 0, disk_bytes = 0;  // bytes: for each stored segment
  double ready_us = 0, cgal_ready_us = 0;                                      // for each tile
  double packed_ns = 0, cgal_ns = 0;                                           // for each near query
  std::vector<double> path_ns;                                                 // the same, by packedTreePaths()
};

InTiles measureTiles(const TileStore& store, std::uint64_t seed) {
  InTiles sum;
  std::mt19937_64 random(seed);
  std::vector<double> ready, cgal_ready;
  const std::vector<std::string> paths = packedTreePaths();
  std::vector<double> cgal_ns;
  std::vector<std::vector<double>> path_ns(paths.size());
  const TileId step = std::max<TileId>(1, store.tile_count() / 24);
  std::size_t segments = 0, tiles = 0;
  for (TileId id = 0; id < store.tile_count(); id += step) {
    if (id == store.long_tile()) continue;
    const std::shared_ptr<const Tile> tile = store.load(id);
    if (tile->segment_count() < 16) continue;
    const std::vector<std::uint8_t> bytes = encodeTile(*tile);
    const TilePlace place{id, tile->key(), tile->isLong(), "memory", 0};
    std::unique_ptr<TileEngine> packed;
    std::vector<SegmentEnds> ends;
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
      ends.push_back({tile->position_W(tile->child(s)), tile->position_W(tile->parent(s))});
    SquaredDistance cgal;
    for (int batch = 0; batch < kBatches; ++batch) {
      ready.push_back(1e6 * seconds([&] {
                        packed = makePackedTree(std::make_shared<const Tile>(decodeTile(bytes, place, store.grid())));
                      }));
      cgal = {};
      cgal_ready.push_back(1e6 * seconds([&] { cgal = cgalPeer().best().build(ends); }));
    }
    segments += tile->segment_count();
    ++tiles;
    sum.tile_bytes += static_cast<double>(tile->bytes());
    sum.tree_bytes += static_cast<double>(packed->bytes());
    sum.disk_bytes += static_cast<double>(bytes.size());

    std::vector<Vector3d> points;
    for (int i = 0; i < 200; ++i) points.push_back(nearPoint(*tile, random));
    std::vector<std::unique_ptr<TileEngine>> trees;
    for (const std::string& path : paths) trees.push_back(makePackedTree(tile, path));
    std::vector<TreeEngine> engines{{"CGAL", cgal, {}}};
    for (std::size_t p = 0; p < paths.size(); ++p)
      engines.push_back({paths[p],
                         [tree = trees[p].get()](const Vector3d& h_W) {
                           Candidates best(1, 0, std::numeric_limits<double>::infinity());
                           tree->search(h_W, best);
                           return best.bound2();
                         },
                         {}});
    race(engines, points);
    cgal_ns.push_back(median(engines[0].ns));
    for (std::size_t p = 0; p < paths.size(); ++p) path_ns[p].push_back(median(engines[p + 1].ns));
  }
  const auto n = static_cast<double>(std::max<std::size_t>(segments, 1));
  sum.stored_per_tile = n / static_cast<double>(std::max<std::size_t>(tiles, 1));
  sum.tile_bytes /= n, sum.tree_bytes /= n, sum.disk_bytes /= n;
  sum.ready_us = median(ready), sum.cgal_ready_us = median(cgal_ready);
  for (const std::vector<double>& ns : path_ns) sum.path_ns.push_back(median(ns));
  sum.packed_ns = sum.path_ns.back(), sum.cgal_ns = median(cgal_ns);
  return sum;
}

std::unique_ptr<TileStore> build(const std::vector<Cell>& library, std::uint64_t segments, double per_um3,
                                 std::uint32_t capacity, std::uint64_t seed, double* side_um = nullptr) {
  DenseCells cells(library, segments, per_um3, seed);
  if (side_um != nullptr) *side_um = cells.side_um();
  return buildTilesInMemory(cells, {.capacity = capacity});
}

// Mean number of tiles that an exact jump searches.
double tilesOpened(const TileStore& store, bool near, std::size_t count, double side_um, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, side_um);
  const Nearest nearest(store, {.budget_bytes = UINT64_MAX});
  std::vector<NearestResult> found;
  double tiles = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::shared_ptr<const Tile> tile = store.load(static_cast<TileId>(random() % store.tile_count()));
    const Vector3d h_W = near ? nearPoint(*tile, random) : Vector3d(place(random), place(random), place(random));
    tiles += nearest.find(h_W, {}, found).tiles_searched;
  }
  return tiles / static_cast<double>(count);
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
  report.versions.emplace_back("CGAL", cgalPeer().version);
  const std::uint64_t in_tiles = options.quick ? 20000 : options.long_run ? 300000 : 100000;
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
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
       "ready_ratio", "packed_ns", "cgal_ns", "query_ratio", "tiles_near", "tiles_uniform"},
      {},
      {"per_um3", "capacity"}};
  BenchTable by_path{"paths",
                     "A near query in one tile, by instruction set: ns, and times faster than CGAL",
                     {"per_um3", "capacity", "path", "ns", "ratio"},
                     {},
                     {"per_um3", "capacity", "path"}};
  for (const double per_um3 : {0.67, 2.1})
    for (const std::uint32_t capacity : {2048u, 4096u, 8192u, 16384u}) {
      if (options.quick && capacity != 4096) continue;
      options.progress("tiles at " + std::to_string(per_um3) + " a um^3, capacity " + std::to_string(capacity));
      double side_um = 0;
      const auto store = build(library, in_tiles, per_um3, capacity, options.seed, &side_um);
      const InTiles m = measureTiles(*store, options.seed);
      const std::size_t count = options.quick ? 100 : 2000;
      const double near = tilesOpened(*store, true, count, side_um, options.seed);
      const double uniform = tilesOpened(*store, false, count, side_um, options.seed);
      tiles.rows.push_back({per_um3, std::int64_t{capacity}, m.stored_per_tile, m.tile_bytes, m.tree_bytes,
                            m.disk_bytes, m.ready_us, m.cgal_ready_us, m.cgal_ready_us / m.ready_us, m.packed_ns,
                            m.cgal_ns, m.cgal_ns / m.packed_ns, near, uniform});
      for (std::size_t p = 0; p < m.path_ns.size(); ++p)
        by_path.rows.push_back(
            {per_um3, std::int64_t{capacity}, packedTreePaths()[p], m.path_ns[p], m.cgal_ns / m.path_ns[p]});
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
  report.tables.push_back(std::move(by_path));
  return report;
}

}  // namespace

void addIndexWorkloads(std::vector<Workload>& all) {
  all.push_back({"index", "tiles in memory, by density and capacity, against CGAL", runIndex});
}

}  // namespace filiform::tools
