// bench scale: what must not grow with the number of segments, and what must, against that number.
#include "index/ingest/ingest.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "index/streaming/residency.h"
#include "solver/graph/graph_view.h"
#include "solver/workspace/navigation.h"
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/knee.h"
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

constexpr std::uint64_t kBudget = 64 << 20;
constexpr std::size_t kJumps = 200;

struct At {
  double segments = 0, ingest_s_million = 0, ingest_mib = 0, bytes = 0, open_ms = 0, tick_ms = 0, jump_us = 0,
         warm_us = 0, navigate_mib = 0, ingest_least = 0, ingest_most = 0;
  std::int64_t ingests = 0;
};

// From the start to a force, then jumps. The first jump to a place reads its tiles; the second finds them in memory.
std::vector<double> measureTravel(const std::string& path, double side_um, std::uint64_t seed) {
  const auto start = Clock::now();
  const auto set = TileSet::open(path);
  const double open_ms = since_ms(start);
  const Nearest nearest(*set, {.budget_bytes = kBudget});
  const Vector3d middle_W = Vector3d::Constant(0.5 * side_um);
  const NearestResult found = nearest.find(middle_W).at(0);
  ResidencyOptions options;
  options.budget_bytes = std::max(kBudget, Residency::floorBytes(*set));
  Residency residency(*set, options);
  TileReader& reader = residency.addReader("hand");
  const GraphView graph(reader.tiles(), set->leaves(), set->grid());
  residency.loadTogether({&found.tile, 1});
  Navigation navigation(graph, makeProxySolver(SolverMethod::climb, SolverParameters{}), {});
  NavigationCommand jump;
  jump.kind = NavigationCommand::Kind::jump;
  jump.place = graph.placeAt(found.tile, found.segment, found.t);
  navigation.apply(jump, Vector3d::Zero());
  DeviceState state;
  state.status = DeviceStatus::ready;
  state.p_D = Vector3d(1e-4, 0, 0);
  if (!navigation.tick(state, 1e-3).solved) throw std::runtime_error("the first tick did not solve");
  const double tick_ms = since_ms(start);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, side_um);
  std::vector<double> cold_us, warm_us;
  std::vector<NearestResult> results;
  for (std::size_t i = 0; i < kJumps; ++i) {
    const Vector3d h_W(place(random), place(random), place(random));
    const auto from = Clock::now();
    const SearchCounts first = nearest.find(h_W, {}, results);
    const double us = 1e3 * since_ms(from);
    if (first.tiles_read > 0) cold_us.push_back(us);
    const auto again = Clock::now();
    nearest.find(h_W);
    warm_us.push_back(1e3 * since_ms(again));
  }
  return {open_ms, tick_ms, percentile(cold_us, 0.5), percentile(warm_us, 0.5)};
}

enum class Law { flat, linear, base_and_linear };

// The expected law: through the largest size, or the middle value of a flat curve. For a base and a linear part:
// through both ends.
PlotSeries lawOf(Law law, const std::vector<double>& n, const std::vector<double>& y) {
  if (law == Law::linear) return lawSeries("N^1", n, y.back() * n.front() / n.back(), 1);
  if (law == Law::flat) return lawSeries("N^0", n, percentile(y, 0.5), 0);
  PlotSeries both{"a + b N", n, {}, false, true};
  for (const double size : n)
    both.y.push_back(y.front() + (y.back() - y.front()) * (size - n.front()) / (n.back() - n.front()));
  return both;
}

BenchReport runScale(const BenchOptions& options) {
  BenchReport report;
  const WorkFolder folder(options.out, "scale");
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  const std::uint64_t largest = options.segments != 0 ? options.segments
                                : options.quick       ? 30'000
                                : options.long_run    ? 200'000'000
                                                      : 1'000'000;
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t n = 10'000; n < largest; n *= 10) {
    sizes.push_back(n);
    if (3 * n < largest) sizes.push_back(3 * n);
  }
  sizes.push_back(largest);

  std::vector<At> all;
  for (const std::uint64_t size : sizes) {
    options.progress("ingest of " + std::to_string(size) + " segments");
    const std::string path = folder.path() + "/set.fil";
    const double side_um = DenseCells(library, size, kPerUm3, options.seed).side_um();
    At at;
    std::vector<double> ingest_s, ingest_mib;
    for (int run = 0; run < ingestRuns(size, options.quick); ++run) {
      const ChildCost made = measureInChild([&]() -> std::vector<double> {
        DenseCells cells(library, size, kPerUm3, options.seed);
        const IngestResult result = ingest(cells, path, {.force = true});
        return {static_cast<double>(result.counts.segments), static_cast<double>(result.bytes)};
      });
      at.segments = made.numbers.at(0);
      at.bytes = made.numbers.at(1) / at.segments;
      ingest_s.push_back(1e6 * made.cpu_s / at.segments);
      ingest_mib.push_back(static_cast<double>(made.peak_bytes) / kMiB);
    }
    at.ingest_s_million = median(ingest_s), at.ingest_mib = median(ingest_mib);
    at.ingest_least = percentile(ingest_s, 0), at.ingest_most = percentile(ingest_s, 1);
    at.ingests = static_cast<std::int64_t>(ingest_s.size());
    std::vector<double> open_ms, tick_ms, jump_us, warm_us, peak_mib;
    for (int i = 0; i < (options.quick ? 2 : kBatches); ++i) {
      options.progress("first tick and jumps in " + std::to_string(size) + " segments");
      const ChildCost cost =
          measureInChild([&] { return measureTravel(path, side_um, options.seed + static_cast<std::uint64_t>(i)); });
      open_ms.push_back(cost.numbers.at(0)), tick_ms.push_back(cost.numbers.at(1));
      jump_us.push_back(cost.numbers.at(2)), warm_us.push_back(cost.numbers.at(3));
      peak_mib.push_back(static_cast<double>(cost.peak_bytes) / kMiB);
    }
    at.open_ms = percentile(open_ms, 0.5), at.tick_ms = percentile(tick_ms, 0.5);
    at.jump_us = percentile(jump_us, 0.5), at.warm_us = percentile(warm_us, 0.5);
    at.navigate_mib = percentile(peak_mib, 0.5);
    const auto n = static_cast<std::int64_t>(at.segments);
    report.samples.push_back({"sizes", {n}, "ingest s", "s", false, ingest_s});
    report.samples.push_back({"sizes", {n}, "open ms", "ms", false, open_ms});
    report.samples.push_back({"sizes", {n}, "first tick ms", "ms", false, tick_ms});
    report.samples.push_back({"sizes", {n}, "jump us", "us", false, jump_us});
    report.samples.push_back({"sizes", {n}, "warm jump us", "us", false, warm_us});
    report.samples.push_back({"sizes", {n}, "MiB", "MiB", false, peak_mib});
    all.push_back(at);
    fs::remove_all(path);
  }

  BenchTable table{
      "sizes",
      "Segments at 0.67 a um^3: ingest in CPU s a million and MiB, bytes a segment on disk; opening and first "
      "tick from nothing (ms); a jump whose tiles are not in memory, and in memory (us, files in the page "
      "cache); peak of the travelling process with 64 MiB for tiles",
      {"segments", "ingest s", "ingest MiB", "bytes", "open ms", "first tick ms", "jump us", "warm jump us", "MiB",
       "ingest least", "ingest most", "ingests"},
      {}};
  std::vector<double> n;
  for (const At& at : all) {
    n.push_back(at.segments);
    table.rows.push_back({static_cast<std::int64_t>(at.segments), at.ingest_s_million, at.ingest_mib, at.bytes,
                          at.open_ms, at.tick_ms, at.jump_us, at.warm_us, at.navigate_mib, at.ingest_least,
                          at.ingest_most, at.ingests});
  }
  report.tables.push_back(std::move(table));
  BenchTable slopes{"slopes",
                    "What grows with the number of segments N: exponent measured over the whole range, over its upper "
                    "half, and expected",
                    {"what", "exponent", "upper half", "expected", "why"},
                    {}};
  const auto curve = [&](const std::string& name, const std::string& title, const std::string& y_label,
                         double At::*what, Law law, const std::string& expected, const std::string& why) {
    PlotSeries measured{"measured", n, {}};
    for (const At& at : all) measured.y.push_back(at.*what * (what == &At::ingest_s_million ? at.segments / 1e6 : 1));
    const std::size_t half = n.size() / 2;
    const std::vector<double> upper_x(n.begin() + static_cast<std::ptrdiff_t>(half), n.end()),
        upper_y(measured.y.begin() + static_cast<std::ptrdiff_t>(half), measured.y.end());
    const double slope = logSlope(n, measured.y), upper = logSlope(upper_x, upper_y);
    BenchCurve one = tradeCurve(name, title, "segments", y_label, {measured, lawOf(law, n, measured.y)}, true, true);
    one.finding =
        "Exponent " + shown(slope) + ", in the upper half " + shown(upper) + "; expected " + expected + ": " + why;
    slopes.rows.push_back({title, slope, upper, expected, why});
    report.curves.push_back(std::move(one));
  };
  curve("ingest", "Ingest", "CPU (s)", &At::ingest_s_million, Law::linear, "1",
        "every segment is read, sorted and written once");
  curve("ingest_memory", "Peak memory of ingest", "MiB", &At::ingest_mib, Law::base_and_linear,
        "0, then 1, then 0 from --memory (1 GiB) on", "what does not fit goes to a file");
  curve("open", "Opening a set", "ms", &At::open_ms, Law::flat, "0",
        "the root page of the directory is read, 16 KiB at most");
  curve("first_tick", "First constrained tick, from nothing", "ms", &At::tick_ms, Law::base_and_linear, "0, then 1",
        "one jump, and the sizes of all tiles, of which the two largest must fit the budget");
  curve("cold_jump", "An exact jump whose tiles are not in memory", "us", &At::jump_us, Law::flat, "0 (log N)",
        "one or two tiles are read, whatever N");
  curve("warm_jump", "An exact jump in memory", "us", &At::warm_us, Law::flat, "0 (log N)",
        "two searches in small trees");
  curve("memory", "Peak memory of the travelling process", "MiB", &At::navigate_mib, Law::base_and_linear, "0, then 1",
        "64 MiB for tiles and as much for the search, and the directory");
  report.tables.push_back(std::move(slopes));
  const At& last = all.back();
  const auto goal = [&](const std::string& what, const std::string& must, const std::string& aim, double measured,
                        double most, double best) {
    report.goals.push_back({what, must, aim, measured, measured <= most, measured <= best});
  };
  goal("opening the largest, ms", "<= 20", "<= 5", last.open_ms, 20, 5);
  goal("first tick in the largest, ms", "<= 50", "<= 10", last.tick_ms, 50, 10);
  report.notes.push_back("Density is the same at every size; medians of processes of their own. Largest: " +
                         std::to_string(largest) + " (--size; 2e8 with --long).");
  return report;
}

}  // namespace

void addScaleWorkloads(std::vector<Workload>& all) {
  all.push_back({"scale", "ingest, opening, first tick, jumps and memory against the number of segments", runScale});
}

}  // namespace filiform::tools
