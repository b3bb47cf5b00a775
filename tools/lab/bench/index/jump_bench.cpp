// bench jump: the time of an exact jump whose tiles are not in memory, against the time to read the same tiles.
#include "index/file/tile_source.h"
#include "index/ingest/ingest.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/workloads.h"

#include <algorithm>
#include <chrono>
#include <fcntl.h>
#include <filesystem>
#include <memory>
#include <random>
#include <stdexcept>
#include <unistd.h>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double since_us(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

// A folder that counts the bytes read, and can remove its files from the system's cache.
class MeteredFolder final : public TileSource {
 public:
  explicit MeteredFolder(const std::string& path) : path_(path), source_(openFolder(path)) {}

  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  std::string describe(const std::string& name) const override { return source_->describe(name); }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    const auto start = Clock::now();
    source_->read(name, offset, bytes);
    read_us += since_us(start);
    bytes_read += bytes.size();
    ++reads;
  }

  void makeCold() const {
    for (const auto& entry : fs::recursive_directory_iterator(path_)) {
      if (!entry.is_regular_file()) continue;
      const int file = ::open(entry.path().c_str(), O_RDONLY | O_CLOEXEC);
      if (file < 0) throw std::runtime_error(entry.path().string() + " cannot be opened");
      ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
      ::close(file);
    }
  }

  mutable double read_us = 0;
  mutable std::uint64_t bytes_read = 0, reads = 0;

 private:
  std::string path_;
  std::unique_ptr<TileSource> source_;
};

struct Costs {
  double jump_us = 0, jump_p90_us = 0, read_us = 0, ratio = 0, tiles = 0, bytes = 0;
};

Costs measureJumps(const std::string& path, bool cold, bool near, double side_um, std::size_t count,
                   std::uint64_t seed) {
  auto owned = std::make_unique<MeteredFolder>(path);
  const MeteredFolder& folder = *owned;
  const auto set = TileSet::open(std::move(owned));
  // Only the trees of the directory are kept between jumps.
  const Nearest nearest(*set, {.budget_bytes = 0});
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, side_um);
  std::normal_distribution<double> jitter(0, 0.5);
  std::vector<Vector3d> points;
  while (points.size() < count) {
    const auto tile = set->load(static_cast<TileId>(random() % set->tile_count()));
    if (tile->node_count() == 0) continue;
    const Vector3d node_W = tile->position_W(static_cast<std::uint32_t>(random() % tile->node_count()));
    points.push_back(near ? Vector3d(node_W + Vector3d(jitter(random), jitter(random), jitter(random)))
                          : Vector3d(place(random), place(random), place(random)));
  }
  for (const Vector3d& h_W : points) nearest.find(h_W);
  std::vector<double> jumps, reads, ratios;
  std::vector<NearestResult> results;
  Costs costs;
  for (const Vector3d& h_W : points) {
    if (cold) folder.makeCold();
    folder.read_us = 0;
    folder.bytes_read = 0;
    const auto start = Clock::now();
    const SearchCounts found = nearest.find(h_W, {}, results);
    const double jump_us = since_us(start);
    if (found.tiles_read == 0) throw std::runtime_error("a jump that must read its tiles read none");
    jumps.push_back(jump_us);
    reads.push_back(folder.read_us);
    ratios.push_back(jump_us / folder.read_us);
    costs.tiles += found.tiles_read / static_cast<double>(count);
    costs.bytes += static_cast<double>(folder.bytes_read) / static_cast<double>(count);
  }
  costs.jump_us = percentile(jumps, 0.5);
  costs.jump_p90_us = percentile(jumps, 0.9);
  costs.read_us = percentile(reads, 0.5);
  costs.ratio = percentile(ratios, 0.5);
  return costs;
}

// Uniform points, each in a set that was just opened: what one `filiform nearest` reads.
std::vector<BenchValue> firstJumps(const std::string& path, double per_um3, double side_um, std::size_t count,
                                   std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, side_um);
  double reads = 0, bytes = 0, opening_reads = 0, opening_bytes = 0;
  for (std::size_t i = 0; i < count; ++i) {
    auto owned = std::make_unique<MeteredFolder>(path);
    const MeteredFolder& folder = *owned;
    const auto set = TileSet::open(std::move(owned));
    opening_reads += static_cast<double>(folder.reads);
    opening_bytes += static_cast<double>(folder.bytes_read);
    folder.reads = folder.bytes_read = 0;
    const double x = place(random), y = place(random), z = place(random);
    Nearest(*set, {}).find(Vector3d(x, y, z));
    reads += static_cast<double>(folder.reads);
    bytes += static_cast<double>(folder.bytes_read);
  }
  const auto n = static_cast<double>(count);
  return {per_um3, reads / n, bytes / n, opening_reads / n, opening_bytes / n};
}

BenchReport runJump(const BenchOptions& options) {
  const std::uint64_t segments = options.segments != 0 ? options.segments : options.quick ? 20000 : 1000000;
  const std::size_t count = options.quick ? 20 : 300;
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  BenchReport report;
  report.notes.push_back(options.corpus.empty() ? "Synthetic neurons; --corpus DIR takes real ones."
                                                : std::to_string(library.size()) + " real reconstructions.");
  report.notes.push_back(
      "Nothing but the directory's trees is kept between jumps. Cold: the set's files are put out of the system's "
      "cache before each jump. Reading: time in the reads of the tiles' bytes. Wall time; medians.");
  BenchTable table{
      "jumps",
      "An exact jump that reads its tiles, us, of sets of " + std::to_string(segments) + " segments",
      {"per_um3", "points", "files", "jump_us", "jump_p90_us", "reading_us", "jump / reading", "tiles", "bytes"},
      {},
      {"per_um3", "points", "files"}};
  BenchTable first{"first jumps",
                   "The first jump after opening, uniform points, sets of " + std::to_string(segments) + " segments",
                   {"per_um3", "reads", "bytes", "opening reads", "opening bytes"},
                   {},
                   {"per_um3"}};
  double worst = 0;
  for (const double per_um3 : {0.67, 2.1}) {
    options.progress("a set at " + std::to_string(per_um3) + " segments a um^3");
    const WorkFolder folder(options.out, "jump");
    const std::string path = folder.path() + "/set.fil";
    DenseCells cells(library, segments, per_um3, options.seed);
    const double side_um = cells.side_um();
    ingest(cells, path, {});
    ::sync();  // files that are not on the disk yet cannot be removed from the cache
    for (const bool near : {true, false})
      for (const bool cold : {true, false}) {
        const Costs c = measureJumps(path, cold, near, side_um, count, options.seed);
        table.rows.push_back({per_um3, std::string(near ? "near" : "uniform"), std::string(cold ? "cold" : "cached"),
                              c.jump_us, c.jump_p90_us, c.read_us, c.ratio, c.tiles, c.bytes});
        if (cold) worst = std::max(worst, c.ratio);
      }
    first.rows.push_back(firstJumps(path, per_um3, side_um, count, options.seed));
  }
  report.goals.push_back({"cold exact jump, times the reading of its tiles, the worst", "<= 1.5", "<= 1.2", worst,
                          worst <= 1.5, worst <= 1.2});
  report.tables.push_back(std::move(table));
  report.tables.push_back(std::move(first));
  return report;
}

}  // namespace

void addJumpWorkloads(std::vector<Workload>& all) {
  all.push_back({"jump", "exact jumps whose tiles are on the disk, against reading them", runJump});
}

}  // namespace filiform::tools
