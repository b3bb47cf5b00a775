// bench extremes: tries extreme data, hands and disks once each, and reports the error or the refusal.
#include "index/errors.h"
#include "index/file/faulty_source.h"
#include "index/ingest/ingest.h"
#include "index/ingest/memory_tiles.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "index/streaming/residency.h"
#include "solver/graph/graph_view.h"
#include "solver/proxy/parameters.h"
#include "solver/travel/run/run.h"
#include "solver/workspace/navigation.h"
#include "tools/lab/bench/index/extreme_cells.h"
#include "tools/lab/bench/workloads.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <sys/resource.h>

#include <Eigen/Geometry>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;

constexpr double kClamp_N = 8;

class Trials {
 public:
  explicit Trials(const BenchOptions& options) : options_(options), random_(options.seed) {}

  // Compares the nearest segment from the index with all segments in long double; error in um.
  void nearest(const std::string& extreme, const std::string& tried, std::vector<Cell> cells, double around_um) {
    options_.progress(extreme);
    try {
      CellList stream(std::move(cells));
      const auto store = buildTilesInMemory(stream);
      std::vector<std::array<Vector3d, 2>> all;
      for (TileId id = 0; id < store->tile_count(); ++id) {
        const auto tile = store->load(id);
        for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
          if (tile->owned(s)) all.push_back({tile->position_W(tile->child(s)), tile->position_W(tile->parent(s))});
      }
      const Nearest search(*store);
      if (all.empty()) {
        put(extreme, tried, "-", "no answer, and no failure", search.find(Vector3d::Zero()).empty());
        return;
      }
      double most = 0, scale = 1, far = 0;
      const std::size_t count = all.size() > 100'000 ? 20 : 200;
      for (std::size_t i = 0; i < count; ++i) {
        const Vector3d h_W = all[random_() % all.size()][0] + around_um * cube();
        far = std::max(far, h_W.cwiseAbs().maxCoeff());
        long double best = std::numeric_limits<long double>::infinity();
        for (const auto& [a_W, b_W] : all) best = std::min(best, distance(h_W, a_W, b_W));
        most = std::max(
            most, static_cast<double>(std::abs(static_cast<long double>(search.find(h_W).at(0).distance_um) - best)));
        scale = std::max(scale, static_cast<double>(best));
      }
      // The result is a point in doubles (53 bits of the largest coordinate) and a distance computed from it.
      const double allowed = 1e-12 * scale + 2 * far * std::numeric_limits<double>::epsilon();
      put(extreme, tried, shown(most) + " um",
          "of a distance up to " + shown(scale) + " um; rounding may be " + shown(allowed) + " um", most <= allowed);
    } catch (const Error& error) {
      put(extreme, tried, "refused", error.what(), false);
    }
  }

  enum class Refusal { none, request, disk };  // the refusal that is accepted: for a bad request or a failing disk

  // Lets a simulated hand travel. At every tick the force must be a number, within its clamp, and grow no faster than
  // the force law states. No tick may test more segments than the work cap.
  void travel(const std::string& extreme, const std::string& tried, const TileStore& store, RunOptions run_options,
              Refusal may_refuse = Refusal::none) {
    options_.progress(extreme + ", " + tried);
    const ForceLawOptions law;
    const double dt_s = 1 / run_options.rate_Hz, stiffness_N_m = run_options.stiffness_N_m.value_or(law.stiffness_N_m);
    const double may_grow_N = dt_s * (law.max_slew_N_s + (law.ramp_s > 0 ? kClamp_N / law.ramp_s : 1e300) +
                                      stiffness_N_m * law.free_speed_m_s);
    double most_N = 0, last_N = 0, growth_N = 0;
    bool finite = true;
    std::uint32_t most_visited = 0;
    try {
      if (!run_options.seconds) run_options.seconds = options_.quick ? 0.5 : 3;
      const RunSummary s = run(store, run_options, [&](const TickRow& row) {
        finite = finite && row.force_N.allFinite() && row.p_W.allFinite();
        most_N = std::max(most_N, row.force_N.norm());
        growth_N = std::max(growth_N, row.force_N.norm() - last_N);
        last_N = row.force_N.norm();
        most_visited = std::max(most_visited, row.visited);
      });
      put(extreme, tried, shown(most_N) + " N at most",
          std::to_string(s.ticks) + " ticks, " + toString(s.outcome) + "; force grows by " + shown(growth_N) +
              " N a tick at most (" + shown(may_grow_N) + " allowed); " + std::to_string(s.frontiers) + " frontiers, " +
              std::to_string(s.failures.size()) + " tiles that could not be read, at most " +
              std::to_string(most_visited) + " segments a tick",
          finite && most_N <= kClamp_N + 1e-9 && growth_N <= may_grow_N + 1e-9 && s.ticks > 0 &&
              most_visited <= SolverParameters{}.max_visited);
    } catch (const UsageError& error) {
      put(extreme, tried, "refused", error.what(), may_refuse == Refusal::request);
    } catch (const Error& error) {
      put(extreme, tried, "refused", error.what(), may_refuse == Refusal::disk);
    }
  }

  void put(const std::string& extreme, const std::string& tried, const std::string& result, const std::string& detail,
           bool pass) {
    rows.push_back({extreme, tried, result, detail, std::string(pass ? "pass" : "missed")});
    passed += pass;
  }

  std::vector<std::vector<BenchValue>> rows;
  std::size_t passed = 0;

 private:
  Vector3d cube() {
    std::uniform_real_distribution<double> unit(-1, 1);
    return {unit(random_), unit(random_), unit(random_)};
  }

  static long double distance(const Vector3d& h_W, const Vector3d& a_W, const Vector3d& b_W) {
    long double ab[3], ah[3], dot = 0, square = 0;
    for (int k = 0; k < 3; ++k) {
      ab[k] = static_cast<long double>(b_W[k]) - a_W[k], ah[k] = static_cast<long double>(h_W[k]) - a_W[k];
      dot += ab[k] * ah[k], square += ab[k] * ab[k];
    }
    const long double t = square > 0 ? std::clamp(dot / square, 0.0L, 1.0L) : 0.0L;
    long double sum = 0;
    for (int k = 0; k < 3; ++k) sum += (ah[k] - t * ab[k]) * (ah[k] - t * ab[k]);
    return std::sqrt(sum);
  }

  const BenchOptions& options_;
  std::mt19937_64 random_;
};

// ---- data

Cell walk(const std::string& name, std::size_t samples, double step_um, const Vector3d& from_W) {
  Cell cell = emptyCell(name + ".swc");
  for (std::size_t i = 0; i < samples; ++i)
    addSample(
        cell,
        from_W + step_um * Vector3d(static_cast<double>(i), static_cast<double>(i % 7), static_cast<double>(i % 3)),
        i == 0 ? kNoParent : static_cast<std::uint32_t>(i - 1));
  return cell;
}

// A neurite of 200 um. All samples but its ends are at one point.
Cell coincident(std::size_t samples) {
  Cell cell = emptyCell("coincident.swc");
  const auto put = [&](double x_um) {
    addSample(cell, Vector3d(x_um, 0, 0),
              cell.samples() == 0 ? kNoParent : static_cast<std::uint32_t>(cell.samples() - 1));
  };
  for (int i = 0; i < 100; ++i) put(i);
  for (std::size_t i = 0; i < samples; ++i) put(100);
  for (int i = 101; i <= 200; ++i) put(i);
  return cell;
}

// Segments that all touch a sphere about the origin from outside.
Cell equidistant(std::size_t segments) {
  Cell cell = emptyCell("sphere.swc");
  for (std::size_t i = 0; i < segments; ++i) {
    const double z = 1 - 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(segments);
    const double r = std::sqrt(1 - z * z), turn = 2.39996 * static_cast<double>(i);
    const Vector3d n(r * std::cos(turn), r * std::sin(turn), z);
    const Vector3d along = n.unitOrthogonal();
    addSample(cell, 10 * n + along, kNoParent);
    addSample(cell, 10 * n - along, static_cast<std::uint32_t>(cell.samples() - 1));
  }
  return cell;
}

std::unique_ptr<TileStore> inMemory(std::vector<Cell> cells) {
  CellList stream(std::move(cells));
  return buildTilesInMemory(stream);
}

RunOptions resident() {
  RunOptions options;
  options.in_memory = true;
  return options;
}

void tryData(const BenchOptions& options, Trials& trials) {
  const std::size_t part = options.quick ? 100 : 1;
  const Vector3d far_W = Vector3d::Constant(999'999'000);
  trials.nearest("coordinates to 1e9 um", "2000 segments of 1 um, 1e9 um from the origin",
                 {walk("far", 2000, 1, far_W)}, 5);
  trials.nearest("coordinates to 1e9 um", "tiny: 2000 segments of 4 nm, 1e9 um from the origin",
                 {walk("tiny", 2000, 1.0 / 256, far_W)}, 0.05);
  trials.nearest("coordinates to 1e9 um", "two cells, 2e9 um apart",
                 {walk("low", 2000, 1, -far_W), walk("high", 2000, 1, far_W)}, 50);
  trials.travel("coordinates to 1e9 um", "a hand at 1e9 um", *inMemory({walk("far", 2000, 1, far_W)}), resident());
  {
    Cell cell = emptyCell("lengths.swc");
    addSample(cell, Vector3d::Zero(), kNoParent);
    for (const double step : {1.0, 0.0, 1e-9, 1e6, 1.0, 0.0, 1e-9, 1.0})
      addSample(cell, cell.positions_um.back() + Vector3d(step, 0, 0), static_cast<std::uint32_t>(cell.samples() - 1));
    trials.nearest("segments of length 0, 1e-9, 1e6 um", "in one neurite of 8", {cell}, 100);
    trials.travel("segments of length 0, 1e-9, 1e6 um", "a hand along it", *inMemory({cell}), resident());
  }
  trials.nearest("coincident nodes", std::to_string(5000 / part) + " at one point", {coincident(5000 / part)}, 3);
  trials.travel("coincident nodes", "a hand there", *inMemory({coincident(5000 / part)}), resident());
  trials.nearest("a node with 10 000 branches", std::to_string(10'000 / part) + " branches",
                 {hubCell(10'000 / part, options.seed)}, 10);
  trials.travel("a node with 10 000 branches", "a hand there", *inMemory({hubCell(10'000 / part, options.seed)}),
                resident());
  trials.nearest("a neurite of 1e6 samples", std::to_string(1'000'000 / part) + " samples",
                 {walk("thread", 1'000'000 / part, 0.5, Vector3d::Zero())}, 5);
  trials.travel("a neurite of 1e6 samples", "a hand along it",
                *inMemory({walk("thread", 1'000'000 / part, 0.5, Vector3d::Zero())}), resident());
  trials.nearest("a comb of 200 000 twigs", std::to_string(200'000 / part) + " twigs", {combCell(200'000 / part)}, 5);
  trials.travel("a comb of 200 000 twigs", "a hand along it", *inMemory({combCell(200'000 / part)}), resident());
  trials.nearest("a set of next to nothing", "no cell", {}, 1);
  trials.nearest("a set of next to nothing", "one node", {walk("node", 1, 1, Vector3d::Zero())}, 5);
  trials.nearest("a set of next to nothing", "one segment", {walk("segment", 2, 1, Vector3d::Zero())}, 5);
  trials.travel("a set of next to nothing", "a hand on one segment",
                *inMemory({walk("segment", 2, 1, Vector3d::Zero())}), resident());
  trials.travel("a set of next to nothing", "a hand where there is no cell", *inMemory({}), resident(),
                Trials::Refusal::request);
  {
    const std::size_t count = 20'000 / part;
    const auto store = inMemory({equidistant(count)});
    const Nearest search(*store);
    std::vector<NearestResult> results;
    const SearchCounts counts = search.find(Vector3d::Zero(), {}, results);
    const NearestResult& found = results.at(0);
    // Rounding to the grid makes the distances differ. The result must be the first of the nearest.
    double best = std::numeric_limits<double>::infinity();
    for (const NearestResult& r : search.find(Vector3d::Zero(), {.k = count})) best = std::min(best, r.distance_um);
    trials.put("all equidistant from the probe", std::to_string(count) + " segments about it",
               shown(found.distance_um - best) + " um",
               "of a distance of 10 um; " + std::to_string(counts.tiles_searched) + " of " +
                   std::to_string(store->tile_count()) + " tiles searched",
               found.distance_um == best);
  }
}

// ---- hands

// Feeds extreme probes directly to the loop's tick.
void tryProbes(const BenchOptions& options, Trials& trials) {
  SyntheticOptions column;
  column.cells = 1;
  column.seed = options.seed;
  SyntheticCells cells(column);
  const auto store = buildTilesInMemory(cells);
  std::vector<std::shared_ptr<const Tile>> tiles;
  TileTable table(store->tile_count());
  for (TileId id = 0; id < store->tile_count(); ++id) {
    tiles.push_back(store->load(id));
    table.add(*tiles.back());
  }
  const GraphView graph(table, store->leaves(), store->grid());
  const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  struct Kind {
    std::string name;
    std::function<Eigen::Vector3d(int tick)> p_D;
    double dt_s = 1e-3;
  };
  const std::vector<Kind> kinds{
      {"NaN every second tick", [&](int i) { return Eigen::Vector3d(i % 2 == 0 ? nan : 0.01, 0, 0); }},
      {"infinite every second tick", [&](int i) { return Eigen::Vector3d(0, i % 2 == 0 ? infinite : 0.01, 0); }},
      {"at 1e300 m", [](int) { return Eigen::Vector3d(1e300, -1e300, 1e300); }},
      {"jumping 1 m a tick", [](int i) { return Eigen::Vector3d(i % 2 == 0 ? 1 : 0, i % 3 == 0 ? -1 : 0, 0); }},
      {"dt 0", [](int i) { return Eigen::Vector3d(1e-3 * (i % 20), 0, 0); }, 0},
      {"dt NaN", [](int i) { return Eigen::Vector3d(1e-3 * (i % 20), 0, 0); }, nan},
      {"dt 1e9 s", [](int i) { return Eigen::Vector3d(1e-3 * (i % 20), 0, 0); }, 1e9}};
  for (const SolverMethod method : kSolverMethods)
    for (const Kind& kind : kinds) {
      options.progress("probes, " + kind.name);
      Navigation navigation(graph, makeProxySolver(method, automaticParameters(*store, 0)), {});
      NavigationCommand jump;
      jump.kind = NavigationCommand::Kind::jump;
      jump.place = graph.placeAt(0, tiles[0]->segmentId(0), 0.5);
      navigation.apply(jump, Eigen::Vector3d::Zero());
      double most_N = 0;
      bool finite = true;
      for (int i = 0; i < 2000; ++i) {
        DeviceState state;
        state.status = DeviceStatus::ready;
        state.p_D = kind.p_D(i);
        const NavigationTick& tick = navigation.tick(state, kind.dt_s);
        finite = finite && tick.wrench.force_N.allFinite() && tick.p_W.allFinite();
        most_N = std::max(most_N, tick.wrench.force_N.norm());
      }
      trials.put("probe that no hand makes", kind.name + ", " + toString(method), shown(most_N) + " N at most",
                 "2000 ticks", finite && most_N <= kClamp_N + 1e-9);
    }
}

void tryHands(const BenchOptions& options, Trials& trials) {
  SyntheticOptions column;
  column.cells = 2;
  column.seed = options.seed;
  SyntheticCells cells(column);
  const auto store = buildTilesInMemory(cells);
  for (const double zoom : {1e-6, 1e-3, 1e3, 1e6}) {
    RunOptions run_options = resident();
    run_options.zoom_um = zoom;
    trials.travel("zoom 1e-6 to 1e6", shown(zoom) + " um across 12 cm", *store, run_options, Trials::Refusal::request);
  }
  for (const double k : {1e-3, 1.0, 1e4, 1e6}) {
    RunOptions run_options = resident();
    run_options.stiffness_N_m = k;
    trials.travel("K 1e-3 to 1e6 N/m", shown(k) + " N/m", *store, run_options, Trials::Refusal::request);
  }
  for (const double rate : {1.0, 10.0, 1e4, 1e6}) {
    RunOptions run_options = resident();
    run_options.rate_Hz = rate;
    run_options.seconds = rate > 1e5 ? 0.05 : rate < 100 ? 30.0 : 1.0;
    trials.travel("dt 1 us to 1 s", shown(1 / rate) + " s", *store, run_options, Trials::Refusal::request);
  }
  for (const int delay : {0, 1, 2}) {
    RunOptions run_options = resident();
    run_options.delay_samples = delay;
    trials.travel("delays", std::to_string(delay) + " samples", *store, run_options);
  }
}

// ---- disks

void tryDisks(const BenchOptions& options, Trials& trials, const std::string& folder) {
  const std::string path = folder + "/set.fil";
  SyntheticOptions column;
  column.cells = 6;
  column.seed = options.seed;
  SyntheticCells cells(column);
  ingest(cells, path, {.capacity = 256});
  const auto set = TileSet::open(path);
  RunOptions run_options;
  run_options.route = {.kind = RouteChoice::Kind::tour, .seed = options.seed};
  run_options.budget_bytes = Residency::floorBytes(*set);
  run_options.latency_ms = 5;
  trials.travel("the smallest budget", std::to_string(*run_options.budget_bytes) + " bytes", *set, run_options);
  run_options.budget_bytes = *run_options.budget_bytes - 1;
  trials.travel("the smallest budget", "a byte less", *set, run_options, Trials::Refusal::request);
  run_options.budget_bytes.reset();
  run_options.latency_ms = 500;
  trials.travel("a disk that is slow", "500 ms a tile", *set, run_options);
  {
    auto source = std::make_unique<FaultySource>(openFolder(path), FaultPlan{.fail_probability = 0.3});
    FaultySource& faults = *source;
    const auto failing = TileSet::open(std::move(source));
    failing->cell(0);  // names are read before the reads begin to fail, because the tiles are to fail
    faults.arm();
    run_options.latency_ms = 5;
    run_options.route = {};
    trials.travel("a disk that fails", "three reads of ten", *failing, run_options, Trials::Refusal::disk);
  }
  options.progress("a disk that is full");
  const std::string full = folder + "/full.fil";
  try {
    measureInChild([&]() -> std::vector<double> {
      const rlimit limit{64 << 10, 64 << 10};
      std::signal(SIGXFSZ, SIG_IGN);
      setrlimit(RLIMIT_FSIZE, &limit);
      SyntheticCells again(column);
      ingest(again, full, {});
      return {};
    });
    trials.put("a disk that is full", "64 KiB", "written", "more than there is room for", false);
  } catch (const std::runtime_error& error) {
    const bool left = fs::exists(full) && !fs::is_empty(full);
    trials.put("a disk that is full", "64 KiB", left ? "leaves files" : "refused, nothing left", error.what(), !left);
  }
}

BenchReport runExtremes(const BenchOptions& options) {
  const WorkFolder folder(options.out, "extremes");
  Trials trials(options);
  tryData(options, trials);
  tryProbes(options, trials);
  tryHands(options, trials);
  tryDisks(options, trials, folder.path());
  BenchReport report;
  const auto missed = static_cast<double>(trials.rows.size() - trials.passed);
  report.goals.push_back({"extremes that fail", "0", "0", missed, missed == 0, missed == 0});
  report.tables.push_back({"extremes",
                           "Each extreme: what was tried, the largest error (against long double), force or refusal",
                           {"extreme", "tried", "result", "detail", "verdict"},
                           std::move(trials.rows),
                           {"extreme", "tried"}});
  report.notes.push_back(
      "Passes: an error within what rounding of coordinates of that size allows; forces that are numbers, within the "
      "clamp of "
      "8 N, that grow no faster than the force law states; no tick above the work cap. A "
      "refusal passes only where the request makes no sense or the disk fails, and by the error that says so.");
  return report;
}

}  // namespace

void addExtremesWorkloads(std::vector<Workload>& all) {
  all.push_back({"extremes", "extreme data, hands and disks: the largest error, or the refusal", runExtremes});
}

}  // namespace filiform::tools
