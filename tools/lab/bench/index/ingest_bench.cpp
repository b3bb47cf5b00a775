// bench ingest: the cost of making, storing and opening a tile set, by its size.
#include "index/ingest/ingest.h"
#include "index/input/input.h"
#include "index/set/tile_set.h"
#include "tools/lab/bench/workloads.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMemory = std::uint64_t{1} << 30;
constexpr double kMillion = 1e6;
constexpr std::uint64_t kMostFromSwc = 10'000'000;  // larger inputs take too long to write as text

SyntheticOptions columnOf(std::uint32_t cells, std::uint64_t seed) {
  SyntheticOptions options;
  options.cells = cells;
  options.seed = seed;
  return options;
}

// Places morphologies of a library side by side, turned about the column's axis, until there are enough segments: like
// a placement table, without the table.
class PlacedLibrary final : public CellStream {
 public:
  enum class Kind { column, voxel, outlier };
  PlacedLibrary(std::uint64_t segments, std::uint64_t seed, Kind kind) : wanted_(segments), random_(seed), kind_(kind) {
    SyntheticCells library(columnOf(30, seed));
    for (Cell cell; library.next(cell);) library_.push_back(cell);
    // Columns of the usual density: a disc of 300 um radius for 31 000 cells of 6000 segments.
    radius_um_ = 210 * std::sqrt(static_cast<double>(segments) / 1.9e8);
  }
  bool next(Cell& cell) override {
    if (given_ >= wanted_) return false;
    cell = library_[number_ % library_.size()];
    char name[40];
    std::snprintf(name, sizeof name, "column/cell_%07llu.swc", static_cast<unsigned long long>(number_));
    cell.source = name;
    cell.digest = number_;
    std::uniform_real_distribution<double> unit;
    const double turn = 6.283185307179586 * unit(random_), r = radius_um_ * std::sqrt(unit(random_)),
                 where = 6.283185307179586 * unit(random_);
    const Vector3d home = cell.positions_um[0], to(r * std::cos(where), home.y(), r * std::sin(where));
    for (Vector3d& p_W : cell.positions_um) {
      const Vector3d d = p_W - home;
      p_W = to + Vector3d(std::cos(turn) * d.x() + std::sin(turn) * d.z(), d.y(),
                          std::cos(turn) * d.z() - std::sin(turn) * d.x());
      if (kind_ == Kind::voxel) p_W *= 1e-3;
    }
    if (kind_ == Kind::outlier && number_ == 0) cell.positions_um.back() = Vector3d(1e9, -1e9, 1e9);
    for (const std::uint32_t parent : cell.parents) given_ += parent != kNoParent;
    ++number_;
    return true;
  }

 private:
  std::uint64_t wanted_, given_ = 0, number_ = 0;
  std::mt19937_64 random_;
  Kind kind_;
  double radius_um_;
  std::vector<Cell> library_;
};

struct IngestRow {
  std::string from;
  double segments = 0, peak_mib = 0, spool_mib = 0, open_ms = 0, tiles = 0;  // peak_mib: the largest of all runs
  std::vector<double> cpu_s_per_million, wall_s;                             // by run
  double packs = 0, directory = 0, cells = 0, samples = 0;                   // bytes a segment
  double bytes() const { return packs + directory + cells + samples; }
};

IngestRow measureIngest(const std::string& from, const std::string& path, int runs,
                        const std::function<std::unique_ptr<CellStream>()>& stream) {
  IngestRow row;
  row.from = from;
  for (int run = 0; run < runs; ++run) {
    const ChildCost cost = measureInChild([&]() -> std::vector<double> {
      const std::unique_ptr<CellStream> cells = stream();
      const IngestResult result = ingest(*cells, path, {.memory = kMemory, .force = true});
      return {static_cast<double>(result.counts.segments), static_cast<double>(result.spool_bytes)};
    });
    row.segments = cost.numbers.at(0);
    row.spool_mib = cost.numbers.at(1) / kMiB;
    row.cpu_s_per_million.push_back(kMillion * cost.cpu_s / row.segments);
    row.wall_s.push_back(cost.wall_s);
    row.peak_mib = std::max(row.peak_mib, static_cast<double>(cost.peak_bytes) / kMiB);
  }
  std::vector<double> opened;
  for (int i = 0; i < 9; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    const auto set = TileSet::open(path);
    opened.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    if (i > 0) continue;
    row.tiles = set->tile_count();
    for (const SetFile& file : set->files()) {
      double& bytes = file.name == "directory.bin" ? row.directory
                      : file.name == "cells.bin"   ? row.cells
                      : file.name == "samples.bin" ? row.samples
                                                   : row.packs;
      bytes += static_cast<double>(file.bytes) / row.segments;
    }
  }
  row.open_ms = percentile(opened, 0.5);
  return row;
}

BenchReport runIngest(const BenchOptions& options) {
  const WorkFolder folder(options.out, "ingest");
  const std::uint64_t largest = options.segments != 0 ? options.segments
                                : options.quick       ? 50'000
                                : options.long_run    ? 100'000'000
                                                      : 1'000'000;
  std::vector<IngestRow> rows;
  using Kind = PlacedLibrary::Kind;
  const auto placed = [&](const char* from, std::uint64_t n, Kind kind) {
    options.progress(std::string(from) + ", " + std::to_string(n) + " segments");
    const std::string path = folder.path() + "/set.fil";
    rows.push_back(measureIngest(from, path, ingestRuns(n, options.quick),
                                 [&] { return std::make_unique<PlacedLibrary>(n, options.seed, kind); }));
    fs::remove_all(path);
  };
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t n = 100'000; n < largest; n *= 10) sizes.push_back(n);
  sizes.push_back(largest);
  for (const std::uint64_t n : sizes) {
    placed("placements", n, Kind::column);
    if (n > kMostFromSwc) continue;
    options.progress("SWC, " + std::to_string(n) + " segments");
    const std::string zip = folder.path() + "/cells.zip", path = folder.path() + "/swc.fil";
    writeSynthetic(columnOf(static_cast<std::uint32_t>(std::max<std::uint64_t>(n / 5000, 2)), options.seed), zip);
    rows.push_back(measureIngest("SWC", path, ingestRuns(n, options.quick),
                                 [&] { return std::make_unique<Input>(std::vector<std::string>{zip}); }));
    fs::remove_all(path);
    fs::remove(zip);
  }
  placed("all in 1 um^3", largest, Kind::voxel);
  placed("one outlier at 1e9 um", largest, Kind::outlier);

  BenchReport report;
  BenchTable cost{"cost",
                  "Ingest with --memory 1GiB: CPU seconds a million segments (median, least and most of the runs), "
                  "clock (median), peak memory (the largest) and spool in MiB",
                  {"from", "segments", "tiles", "cpu_s_per_million", "wall_s", "peak_mib", "spool_mib", "open_ms",
                   "cpu_least", "cpu_most", "runs"},
                  {},
                  {"from", "segments"}};
  BenchTable size{"size",
                  "Bytes a segment by file",
                  {"from", "segments", "packs", "directory", "cells", "samples", "all"},
                  {},
                  {"from", "segments"}};
  double worst_cpu = 0, worst_peak = 0, worst_bytes = 0;
  std::vector<double> open_ms;
  for (const IngestRow& r : rows) {
    const auto n = static_cast<std::int64_t>(r.segments);
    cost.rows.push_back({r.from, n, static_cast<std::int64_t>(r.tiles), median(r.cpu_s_per_million), median(r.wall_s),
                         r.peak_mib, r.spool_mib, r.open_ms, percentile(r.cpu_s_per_million, 0),
                         percentile(r.cpu_s_per_million, 1), static_cast<std::int64_t>(r.wall_s.size())});
    report.samples.push_back({"cost", {r.from, n}, "cpu_s_per_million", "s", false, r.cpu_s_per_million});
    size.rows.push_back({r.from, n, r.packs, r.directory, r.cells, r.samples, r.bytes()});
    worst_peak = std::max(worst_peak, r.peak_mib);
    if (r.segments < 0.9 * kMillion && !options.quick) continue;
    worst_cpu = std::max(worst_cpu, median(r.cpu_s_per_million));
    if (r.from == "placements" || r.from == "SWC") {
      worst_bytes = std::max(worst_bytes, r.bytes());
      open_ms.push_back(r.open_ms);
    }
  }
  report.tables = {cost, size};
  const auto most = [&](const char* what, const char* must, const char* aim, double measured, double m, double a) {
    report.goals.push_back({what, must, aim, measured, measured <= m, measured <= a});
  };
  const double allowed = static_cast<double>(kMemory) / kMiB + 200;
  most("CPU seconds a million segments, median of the runs, the worst from 1e6 on", "<= 0.6", "<= 0.3", worst_cpu, 0.6,
       0.3);
  most("peak memory, MiB, the worst", "<= 1224", "<= 1224", worst_peak, allowed, allowed);
  most("bytes a segment on disk, without levels of detail", "<= 9", "<= 7", worst_bytes, 9, 7);
  if (!open_ms.empty())
    most("opening a set, ms, the largest", "<= 20", "<= 5", *std::max_element(open_ms.begin(), open_ms.end()), 20, 5);
  report.notes.push_back(
      "Seed " + std::to_string(options.seed) +
      "; synthetic neurons; CPU is the whole child process, reading or placing included; sets opened "
      "with warm files, median of 9.");
  return report;
}

}  // namespace

void addIngestWorkloads(std::vector<Workload>& all) {
  all.push_back({"ingest", "making, keeping and opening tile sets, against the number of segments", runIngest});
}

}  // namespace filiform::tools
