// bench storage: what the grid's quantum, a tile's capacity and the levels of detail cost and give.
#include "index/ingest.h"
#include "index/levels.h"
#include "index/memory_tiles.h"
#include "index/nearest.h"
#include "index/packed_tree.h"
#include "index/tile_codec.h"
#include "index/tile_set.h"
#include "tools/bench/dense_cells.h"
#include "tools/bench/trade.h"
#include "tools/bench/workloads.h"
#include "tools/synthetic.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kPerUm3 = 0.67;

double since_ms(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Cells as they were before the grid, kept to compare with.
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
  double at_default = 0, at_coarse = 0;
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
    if (exponent == Grid::kDefaultExponent) at_default = per_segment;
    if (exponent <= -4) at_coarse = per_segment;
    fs::remove_all(path);
  }
  BenchCurve curve = tradeCurve("grid", "Grid: bytes against position error", "largest position error (nm)",
                                "bytes a segment on disk", {bytes}, true, false);
  addMark(curve, 1e3 * 0.5 * std::sqrt(3.0) * std::ldexp(1.0, Grid::kDefaultExponent), "default");
  const std::string knee = markKnee(curve);
  const double halvings = std::log2(bytes.x.back() / bytes.x.front());
  curve.finding = "Each halving of the quantum costs " + shown(8 * (bytes.y.front() - bytes.y.back()) / halvings) +
                  " bits a segment on average (" + knee + "). The default of 2 nm takes " + shown(at_default) +
                  " bytes; the coarsest grid up to 62 nm would take " + shown(at_coarse) +
                  ". The default is finer than any reconstruction: it stays so that coordinates of three decimals of a "
                  "um come back to the nm.";
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
  PlotSeries jump{"a jump, uniform", {}, {}}, ready{"a tile ready", {}, {}}, jump_near{"a jump, near", {}, {}};
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> place(0, side_um);
  std::normal_distribution<double> jitter(0, 0.5);
  double best = INFINITY, best_capacity = 0, at_default = 0;
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
    for (int batch = 0; batch < 2; ++batch)  // the first one warms up
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
    report.samples.push_back({"cached jump, uniform, capacity " + std::to_string(capacity), "us", false, jump_us[1]});
    table.rows.push_back({std::int64_t{capacity}, static_cast<std::int64_t>(set->tile_count()),
                          static_cast<double>(made.counts.stored_segments) / segments,
                          static_cast<double>(made.bytes) / segments, percentile(ready_us, 0.5), opened[0] / n,
                          opened[1] / n, near_us, uniform_us, static_cast<std::int64_t>(largest)});
    jump.x.push_back(capacity), jump.y.push_back(uniform_us);
    jump_near.x.push_back(capacity), jump_near.y.push_back(near_us);
    ready.x.push_back(capacity), ready.y.push_back(percentile(ready_us, 0.5));
    if (capacity == standard) at_default = uniform_us;
    if (uniform_us < best) best = uniform_us, best_capacity = capacity;
    fs::remove_all(path);
  }
  BenchCurve curve = tradeCurve("capacity", "Tile capacity: a jump that reads its tiles, and one tile",
                                "capacity (segments)", "us", {jump, jump_near, ready}, true, true);
  addMark(curve, standard, "default");
  addMark(curve, best_capacity, "fastest jump");
  curve.finding =
      "Small tiles are ready sooner, but more of them are opened and ghosts are stored again; the fastest "
      "uniform jump is at " +
      shown(best_capacity) + " (" + shown(best) + " us), the default of " + std::to_string(standard) + " takes " +
      shown(at_default) + " us.";
  report.curves.push_back(std::move(curve));
  report.tables.push_back(std::move(table));
}

void measureLevels(const BenchOptions& options, const std::string& folder, BenchReport& report) {
  options.progress("a set with levels of detail");
  const std::string path = folder + "/levels.fil";
  const std::uint64_t wanted = options.quick ? 20'000 : 1'000'000;
  SyntheticOptions column;
  column.cells = static_cast<std::uint32_t>(std::max<std::uint64_t>(2, wanted / 4500));
  column.seed = options.seed;
  SyntheticCells cells(column);
  ingest(cells, path, {.levels = true});
  const auto set = TileSet::open(path);
  const auto levels = Levels::open(*set);
  const Grid grid = set->grid();
  const Vector3d lo = grid.toWorld(set->bounds().lo), hi = grid.toWorld(set->bounds().hi);
  // The whole of it on a screen of 1080 rows, under 45 degrees.
  LevelView view;
  view.pixels_per_rad = 1080 / (2 * std::tan(0.3927));
  view.eye_W =
      0.5 * (lo + hi) + Vector3d(0, 0, 0.5 * (hi - lo).maxCoeff() / std::tan(0.3927) + 0.5 * (hi.z() - lo.z()));
  const auto all = static_cast<double>(set->counts().segments);

  BenchTable table{"levels",
                   "Levels of detail, the whole column on 1080 rows: what is allowed, what is drawn, the largest error "
                   "on the screen (pixels), what nothing stands for, and ms to load the parts",
                   {"allowed", "enough px", "segments", "error px", "left out", "parts", "load ms"},
                   {}};
  PlotSeries budget{"largest error", {}, {}}, tolerance{"segments drawn", {}, {}};
  const auto choose = [&](std::uint64_t most, double enough) {
    const LevelChoice choice = levels->choose(view, most, enough);
    const auto start = Clock::now();
    std::size_t loaded = 0;
    for (const LevelPart& part : choice.parts)
      loaded += (part.level ? levels->load(part.tile) : set->load(part.tile))->segment_count();
    const double load_ms = since_ms(start);
    if (loaded == 0) throw std::logic_error("nothing was chosen");
    table.rows.push_back({static_cast<std::int64_t>(most), enough, static_cast<std::int64_t>(choice.segments),
                          choice.error_px, static_cast<std::int64_t>(choice.dropped),
                          static_cast<std::int64_t>(choice.parts.size()), load_ms});
    return choice;
  };
  for (std::uint64_t most = 2000; most < 4 * wanted; most *= 2) {
    options.progress("levels within " + std::to_string(most) + " segments");
    const LevelChoice choice = choose(most, 0);
    budget.x.push_back(static_cast<double>(most)), budget.y.push_back(choice.error_px);
  }
  for (const double enough : {0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
    const LevelChoice choice = choose(std::numeric_limits<std::uint64_t>::max() / 2, enough);
    tolerance.x.push_back(enough), tolerance.y.push_back(static_cast<double>(choice.segments));
    report.bounds.push_back({"levels, " + shown(enough) + " px asked for",
                             "error at most as asked, room given (levels.h)", enough, choice.error_px, "px"});
  }
  BenchCurve by_budget = tradeCurve("segment_budget", "Segments drawn: largest error on the screen", "segments allowed",
                                    "error (pixels)", {budget}, true, true);
  addMark(by_budget, std::max(2e3, all), "exact");
  addMark(by_budget, 2e6, "default");
  by_budget.finding = "The error falls as the budget grows (" + markKnee(by_budget) +
                      "); the default of 2 000 000 shows a column of " + shown(all) +
                      " segments within its tolerance. What a frame takes is the viewer's workload.";
  report.curves.push_back(std::move(by_budget));
  BenchCurve by_tolerance = tradeCurve("tolerance", "Tolerance on the screen: segments drawn", "tolerance (pixels)",
                                       "segments", {tolerance}, true, true);
  addMark(by_tolerance, 0.5, "default");
  const std::string knee = markKnee(by_tolerance);
  by_tolerance.finding = "Half a pixel cannot be seen and takes " + shown(tolerance.y.at(1)) +
                         " segments, four pixels " + shown(tolerance.y.at(4)) + " (" + knee + ").";
  report.curves.push_back(std::move(by_tolerance));
  report.tables.push_back(std::move(table));

  // Against every segment that a level tile stands for: on a small set, since it is slow.
  options.progress("checking every level");
  SyntheticOptions few;
  few.cells = 4;
  few.seed = options.seed;
  SyntheticCells small(few);
  ingest(small, folder + "/few.fil", {.levels = true});
  const auto few_set = TileSet::open(folder + "/few.fil");
  const auto few_levels = Levels::open(*few_set);
  report.bounds.push_back({"levels of detail, each tile of four cells",
                           "all but those said to be left out lie within its error (levels.h); tiles where not", 0,
                           static_cast<double>(checkLevels(*few_set, *few_levels).size()), "tiles"});
}

BenchReport runStorage(const BenchOptions& options) {
  BenchReport report;
  const WorkFolder folder(options.out, "storage");
  const std::uint64_t segments = options.quick ? 20'000 : 500'000;
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  if (library.empty()) throw std::runtime_error("no reconstruction below " + options.corpus + " can be used");
  DenseCells dense(library, segments, kPerUm3, options.seed);
  std::vector<Cell> cells;
  for (Cell cell; dense.next(cell);) cells.push_back(cell);
  measureGrid(options, cells, folder.path(), report);
  measureCapacity(options, cells, dense.side_um(), folder.path(), report);
  measureLevels(options, folder.path(), report);
  report.notes.push_back(std::to_string(segments) +
                         " segments at 0.67 a um^3 for grid and capacity; levels: a synthetic column.");
  return report;
}

}  // namespace

void addStorageWorkloads(std::vector<Workload>& all) {
  all.push_back(
      {"storage", "the grid's quantum, a tile's capacity, levels of detail: bytes and time against error", runStorage});
}

}  // namespace filiform::tools
