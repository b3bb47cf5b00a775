// bench cells: the time to read all cells of a set, against decoding each of its tiles once.
#include "index/ingest/ingest.h"
#include "index/query/cell_pass.h"
#include "index/query/kept_tiles.h"
#include "index/query/segment_pass.h"
#include "index/set/tile_set.h"
#include "tools/lab/bench/workloads.h"
#include "tools/synthetic/synthetic.h"

#include <ctime>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace filiform::tools {

namespace {

double threadCpu_ms() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

// A way to read all cells; returns what it read, in samples or segments.
struct CellsWay {
  std::string name;
  std::function<std::uint64_t()> run;
  std::vector<double> ms{};
};

std::vector<CellsWay> waysToReadCells(const TileSet& set, const std::vector<std::uint32_t>& cells) {
  constexpr std::uint64_t kKept = 64 * kMiB;  // as the service and Python keep by default
  const auto one_by_one = [&cells](const TileStore& store) {
    std::uint64_t samples = 0;
    for (const std::uint32_t cell : cells) samples += readCell(store, cell, true).samples();
    return samples;
  };
  return {{"decode each tile once",
           [&set] {
             std::uint64_t segments = 0;
             for (TileId tile = 0; tile < set.tile_count(); ++tile)
               segments += set.load(tile)->owned_count() + (set.loadAppearance(tile).types.empty() ? 0 : 1);
             return segments;
           }},
          {"all segments in one pass",
           [&set] {
             std::uint64_t segments = 0;
             forEachSegment(set, {.with_appearance = true},
                            [&](TileId, std::span<const PassedSegment> passed) { segments += passed.size(); });
             return segments;
           }},
          {"all cells in one pass",
           [&set, &cells] {
             CellPass pass(set, cells);
             std::uint64_t samples = 0;
             for (std::size_t i = 0; i < cells.size(); ++i) samples += pass.next().samples();
             return samples;
           }},
          {"cells one by one, 64 MiB of tiles kept", [&set, one_by_one] { return one_by_one(KeptTiles(set, kKept)); }},
          {"cells one by one, no tile kept", [&set, one_by_one] { return one_by_one(set); }}};
}

BenchReport runCells(const BenchOptions& options) {
  const WorkFolder folder(options.out, "cells");
  std::string path = options.scene;
  if (path.empty()) {
    path = folder.path() + "/set.fil";
    SyntheticOptions column;
    column.cells = static_cast<std::uint32_t>(options.quick ? 4 : 220);
    column.seed = options.seed;
    SyntheticCells cells(column);
    ingest(cells, path, {});
  }
  const auto set = TileSet::open(path);
  std::vector<std::uint32_t> cells;
  std::uint64_t asked = 0;
  for (std::uint32_t cell = 0; cell < set->cell_count(); ++cell) {
    if (set->cell(cell).removed) continue;
    cells.push_back(cell);
    asked += set->cellTiles(cell).size();
  }
  std::vector<CellsWay> ways = waysToReadCells(*set, cells);
  for (int batch = 0; batch <= (options.quick ? 1 : kBatches); ++batch)
    for (CellsWay& way : ways) {
      options.progress(way.name);
      const double start = threadCpu_ms();
      if (way.run() == 0) throw std::runtime_error("nothing was read: " + way.name);
      if (batch > 0) way.ms.push_back(threadCpu_ms() - start);  // the first reads the directory
    }

  BenchReport report;
  report.notes.push_back((options.scene.empty() ? std::string("A synthetic column") : "The set given") + ": " +
                         std::to_string(cells.size()) + " cells, " + std::to_string(set->segmentCount()) +
                         " segments, " + std::to_string(set->tile_count()) + " tiles; the cells name " +
                         std::to_string(asked) + " tiles. CPU time of one thread; files in the system's cache.");
  BenchTable table{
      "cells", "Reading all cells of a set with radii and types", {"way", "cpu_ms", "times decoding"}, {}, {"way"}};
  std::vector<double> times;
  for (CellsWay& way : ways) {
    times.push_back(median(way.ms) / median(ways[0].ms));
    table.rows.push_back({way.name, median(way.ms), times.back()});
    report.samples.push_back({"cells", {way.name}, "cpu_ms", "ms", false, way.ms});
  }
  report.tables.push_back(std::move(table));
  report.goals.push_back(
      {"all cells in one pass / decoding each tile once", "<= 3", "<= 2", times[2], times[2] <= 3, times[2] <= 2});
  report.goals.push_back({"cells one by one with kept tiles / decoding each tile once", "<= 6", "<= 4", times[3],
                          times[3] <= 6, times[3] <= 4});
  return report;
}

}  // namespace

void addCellsWorkloads(std::vector<Workload>& all) {
  all.push_back({"cells", "all cells of a set, against decoding each of its tiles once", runCells});
}

}  // namespace filiform::tools
