// bench storage: costs and benefits of the grid's quantum and the tile capacity.
#include "index/build/ingest.h"
#include "index/build/memory_tiles.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "index/tile/packed_tree.h"
#include "index/tile/tile_codec.h"
#include "tools/lab/bench/dense_cells.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <random>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Keeps the cells before rounding to the grid, for comparison.
class KeptCells final : public CellStream {
 public:
  explicit KeptCells(const std::vector<Cell>& cells) : cells_(cells) {}
  bool next(Cell& cell) override {
    if (at_ == cells_.size()) return false;
    cell = cells_[at_++];
    return true;
  }

 private:
  const std::vector<Cell>& cells_;
  std::size_t at_ = 0;
};

void measureGrid(const BenchOptions& options, const std::vector<Cell>& cells, const std::string& folder,
                 BenchReport& report) {
  BenchTable table{
      "grid",
      "The grid's quantum: bytes a segment of the whole set on disk, and how far nodes lie from where they "
      "were read (nm)",
      {"exponent", "quantum um", "bytes a segment", "of tiles", "error mean nm", "error most nm", "stated nm"},
      {}};
  PlotSeries bytes{"bytes a segment", {}, {}};
  double at_default = 0, default_nm = 0, at_coarse = 0;
  for (const int exponent : {-10, -9, -8, -7, -6, -5, -4, -3, -2, -1, 0}) {
    if (options.quick && exponent % 3 != 0) continue;
    options.progress("quantum 2^" + std::to_string(exponent) + " um");
    const std::string path = folder + "/grid.fil";
    KeptCells stream(cells);
    const IngestResult made = ingest(stream, path, {.quantum_exponent = exponent});
    const auto set = TileSet::open(path);
    double packs = 0, sum = 0, most = 0, nodes = 0;
    for (const SetFile& file : set->files())
      if (file.name != "directory.bin" && file.name != "cells.bin" && file.name != "samples.bin")
        packs += static_cast<double>(file.bytes);
    for (TileId id = 0; id < set->tile_count(); ++id) {
      const auto tile = set->load(id);
      for (std::uint32_t node = 0; node < tile->node_count(); ++node) {
        const NodeId at = tile->nodeId(node);
        const double error = (tile->position_W(node) - cells[at.cell].positions_um[at.sample]).norm();
        sum += error, most = std::max(most, error), nodes += 1;
      }
    }
    const auto segments = static_cast<double>(made.counts.segments);
    const double quantum = std::ldexp(1.0, exponent), stated = 0.5 * std::sqrt(3.0) * quantum;
    const double per_segment = static_cast<double>(made.bytes) / segments;
    table.rows.push_back(
        {std::int64_t{exponent}, quantum, per_segment, packs / segments, 1e3 * sum / nodes, 1e3 * most, 1e3 * stated});
    report.bounds.push_back({"grid of 2^" + std::to_string(exponent) + " um", "half a quantum an axis (grid.h)",
                             1e3 * stated, 1e3 * most, "nm"});
    bytes.x.push_back(1e3 * most), bytes.y.push_back(per_segment);
    if (exponent == Grid::kDefaultExponent) at_default = per_segment, default_nm = 1e3 * most;
    if (exponent <= -4) at_coarse = per_segment;
    fs::remove_all(path);
  }
  BenchCurve curve = tradeCurve("grid", "Grid: bytes against position error", "largest position error (nm)",
                                "bytes a segment on disk", {bytes}, true, false);
  addLine(curve, default_nm, "default");
  const std::string knee = lineAtKnee(curve);
  const double halvings = std::log2(bytes.x.back() / bytes.x.front());
  curve.finding =
      "Each halving of the quantum costs " + shown(8 * (bytes.y.front() - bytes.y.back()) / halvings) +
      " bits a segment on average (" + knee + "). The default of 2 nm takes " + shown(at_default) +
      " bytes; the coarsest grid up to 62 nm would take " + shown(at_coarse) +
      ". What was read, three doubles a node, would be exact with 24. The default is the coarsest grid on which "
      "coordinates of three decimals of a um come back to the nm: it stays.";
  report.curves.push_back(std::move(curve));
  report.tables.push_back(std::move(table));
}

void measureCapacity(const BenchOptions& options, const std::vector<Cell>& cells, double side_um,
                     const std::string& folder, BenchReport& report) {
  BenchTable table{"capacity",
                   "Segments that a tile may own: stored in all for one of the set, bytes on disk, us until a tile's "
                   "bytes can be queried, tiles an exact jump opens, and what such a jump takes when it keeps nothing "
                   "(files in the page cache; us)",
                   {"capacity", "tiles", "stored a segment", "bytes a segment", "tile ready us", "tiles near",
                    "tiles uniform", "jump near us", "jump uniform us", "largest tile bytes"},
                   {}};
  PlotSeries jump{"a jump, uniform", {}, {}}, ready{"a tile ready", {}, {}}, jump_near{"a jump, near", {}, {}},
      bytes{"bytes a segment on disk", {}, {}};
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> place(0, side_um);
  std::normal_distribution<double> jitter(0, 0.5);
  double best = INFINITY, best_capacity = 0, at_default = 0, default_bytes = 0;
  const std::uint32_t standard = PartitionOptions{}.capacity;
  for (std::uint32_t capacity = 256; capacity <= 32768; capacity *= 2) {
    if (options.quick && capacity != 1024 && capacity != standard && capacity != 8192) continue;
    options.progress("capacity " + std::to_string(capacity));
    const std::string path = folder + "/capacity.fil";
    KeptCells stream(cells);
    const IngestResult made = ingest(stream, path, {.capacity = capacity});
    const auto set = TileSet::open(path);
    std::vector<double> ready_us, jump_us[2];
    std::uint64_t largest = 0;
    const TileId step = std::max<TileId>(1, set->tile_count() / 48);
    for (TileId id = 0; id < set->tile_count(); ++id) {
      largest = std::max(largest, set->entry(id).decoded_bytes);
      if (id % step != 0) continue;
      const auto start = threadTime_s();
      const auto tree = makePackedTree(set->load(id));
      ready_us.push_back(1e6 * (threadTime_s() - start));
    }
    const Nearest nearest(*set, {.budget_bytes = 0});
    double opened[2] = {0, 0};
    const std::size_t count = options.quick ? 20 : 400;
    for (int batch = 0; batch < 2; ++batch)  // the first batch warms the caches
      for (const int uniform : {0, 1}) {
        opened[uniform] = 0;
        jump_us[uniform].clear();
        for (std::size_t i = 0; i < count; ++i) {
          const Cell& cell = cells[random() % cells.size()];
          const Vector3d near_W =
              cell.positions_um[random() % cell.samples()] + Vector3d(jitter(random), jitter(random), jitter(random));
          const Vector3d h_W = uniform == 1 ? Vector3d(place(random), place(random), place(random)) : near_W;
          const auto start = Clock::now();
          opened[uniform] += nearest.find(h_W).at(0).tiles_searched;
          jump_us[uniform].push_back(1e3 * since_ms(start));
        }
      }
    const auto segments = static_cast<double>(made.counts.segments), n = static_cast<double>(count);
    const double near_us = percentile(jump_us[0], 0.5), uniform_us = percentile(jump_us[1], 0.5);
    report.samples.push_back(
        {table.name, {std::int64_t{capacity}}, "jump uniform us", "us", false, batchMedians(jump_us[1])});
    table.rows.push_back({std::int64_t{capacity}, static_cast<std::int64_t>(set->tile_count()),
                          static_cast<double>(made.counts.stored_segments) / segments,
                          static_cast<double>(made.bytes) / segments, percentile(ready_us, 0.5), opened[0] / n,
                          opened[1] / n, near_us, uniform_us, static_cast<std::int64_t>(largest)});
    jump.x.push_back(capacity), jump.y.push_back(uniform_us);
    jump_near.x.push_back(capacity), jump_near.y.push_back(near_us);
    bytes.x.push_back(capacity), bytes.y.push_back(static_cast<double>(made.bytes) / segments);
    if (capacity == standard) default_bytes = bytes.y.back();
    ready.x.push_back(capacity), ready.y.push_back(percentile(ready_us, 0.5));
    if (capacity == standard) at_default = uniform_us;
    if (uniform_us < best) best = uniform_us, best_capacity = capacity;
    fs::remove_all(path);
  }
  BenchCurve curve = tradeCurve("capacity", "Tile capacity: a jump that reads its tiles, and one tile",
                                "capacity (segments)", "us; bytes", {jump, jump_near, ready, bytes}, true, true);
  addLine(curve, standard, "default");
  addLine(curve, best_capacity, "fastest jump");
  const std::string knee = lineAtKnee(curve, 3);
  curve.finding = "Small tiles are ready sooner, but their ghosts are stored again: a uniform jump takes " +
                  shown(best) + " us at " + shown(best_capacity) + " and " + shown(at_default) + " at the default of " +
                  std::to_string(standard) + ", a segment " + shown(bytes.y.front()) + " bytes at " +
                  shown(bytes.x.front()) + ", " + shown(default_bytes) + " at the default, " + shown(bytes.y.back()) +
                  " at " + shown(bytes.x.back()) + " (of the bytes: " + knee + ").";
  report.curves.push_back(std::move(curve));
  report.tables.push_back(std::move(table));
}

BenchReport runStorage(const BenchOptions& options) {
  BenchReport report;
  const WorkFolder folder(options.out, "storage");
  const std::uint64_t segments = options.quick ? 20'000 : 500'000;
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  DenseCells dense(library, segments, kPerUm3, options.seed);
  std::vector<Cell> cells;
  for (Cell cell; dense.next(cell);) cells.push_back(cell);
  measureGrid(options, cells, folder.path(), report);
  measureCapacity(options, cells, dense.side_um(), folder.path(), report);
  report.notes.push_back(std::to_string(segments) + " segments at 0.67 a um^3.");
  return report;
}

}  // namespace

void addStorageWorkloads(std::vector<Workload>& all) {
  all.push_back({"storage", "the grid's quantum and a tile's capacity: bytes and time against error", runStorage});
}

}  // namespace filiform::tools
