// bench streaming: opening a set, and the effect on the hand of tiles that are read from a disk.
#include "index/file/faulty_source.h"
#include "index/ingest/ingest.h"
#include "index/levels/levels.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "index/streaming/residency.h"
#include "solver/graph/graph_view.h"
#include "solver/travel/run/run.h"
#include "solver/workspace/navigation.h"
#include "tools/lab/bench/knee.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <thread>

namespace filiform::tools {

namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string withUnit(std::uint64_t n) {
  return n >= 1'000'000 ? std::to_string(n / 1'000'000) + "e6" : std::to_string(n / 1000) + "e3";
}

// The sets of this workload, in a temporary folder.
class Sets {
 public:
  explicit Sets(const BenchOptions& options) : options_(options), folder_(options.out, "streaming") {}

  struct Made {
    std::string path;
    double cpu_s = 0;  // median of ingestRuns
  };
  // Made in child processes, so that their memory does not count in the measurements.
  Made make(std::uint64_t segments, bool levels) const {
    const std::string path = folder_.path() + "/" + std::to_string(segments) + (levels ? ".fil" : "-bare.fil");
    std::vector<double> cpu_s;
    const auto one = [&] {
      SyntheticOptions column;
      column.cells = static_cast<std::uint32_t>(std::max(2.0, static_cast<double>(segments) / kSegmentsPerCell));
      column.seed = options_.seed;
      SyntheticCells cells(column);
      IngestOptions ingesting;
      ingesting.levels = levels;
      ingesting.force = true;
      ingest(cells, path, ingesting);
      return std::vector<double>{};
    };
    for (int run = 0; run < ingestRuns(segments, options_.quick); ++run) cpu_s.push_back(measureInChild(one).cpu_s);
    return {path, median(cpu_s)};
  }

 private:
  const BenchOptions& options_;
  WorkFolder folder_;
};

// ---- opening

struct Opening {
  double open_s, first_tick_s;
};

// From the start to a force: open, find the nearest segment to the middle of the data, load its tile, one tick.
Opening openOnce(const std::string& path) {
  const auto start = Clock::now();
  const auto set = TileSet::open(path);
  Opening opening{since(start), 0};
  const Vector3d middle_W = 0.5 * (set->grid().toWorld(set->bounds().lo) + set->grid().toWorld(set->bounds().hi));
  const Nearest nearest(*set);
  const std::vector<NearestResult> found = nearest.find(middle_W);
  ResidencyOptions options;
  options.budget_bytes = 64 * kMiB;
  Residency residency(*set, options);
  TileReader& reader = residency.addReader("hand");
  const GraphView graph(reader.tiles(), set->leaves(), set->grid());
  residency.loadTogether({&found.at(0).tile, 1});
  Navigation navigation(graph, makeProxySolver(SolverMethod::force, SolverParameters{}), {});
  NavigationCommand jump;
  jump.kind = NavigationCommand::Kind::jump;
  jump.place = graph.placeAt(found[0].tile, found[0].segment, found[0].t);
  navigation.apply(jump, Vector3d::Zero());
  DeviceState state;
  state.status = DeviceStatus::ready;
  state.p_D = Vector3d(1e-4, 0, 0);
  const NavigationTick& tick = navigation.tick(state, 1e-3);
  if (!tick.solved) throw std::runtime_error("the first tick did not solve");
  opening.first_tick_s = since(start);
  return opening;
}

void measureOpening(const BenchOptions& options, const Sets& sets, const std::vector<std::uint64_t>& sizes,
                    std::vector<std::string>& paths, BenchReport& report) {
  BenchTable table{"opening",
                   "Opening and first constrained tick (nearest segment, its tile, one tick), files in the page cache",
                   {"segments", "tiles", "open ms", "open p90 ms", "first tick ms", "first tick p90 ms"},
                   {}};
  BenchTable levels{
      "levels",
      "Levels of detail: what they add (ingest CPU: difference of the medians of the runs with and without)",
      {"segments", "level tiles", "CPU s a million", "B a segment", "of it levels", "coarsest segments", "its error um",
       "left out"},
      {}};
  std::vector<double> opens, ticks;
  double bytes_per_segment = 0;
  for (const std::uint64_t size : sizes) {
    options.progress("making " + withUnit(size) + " segments");
    const Sets::Made bare = sets.make(size, false), made = sets.make(size, true);
    paths.push_back(made.path);
    const auto set = TileSet::open(made.path);
    options.progress("opening " + withUnit(size) + " segments");
    std::vector<double> open_ms, tick_ms;
    for (int i = 0; i < (options.quick ? 3 : 25); ++i) {
      const Opening opening = openOnce(made.path);
      open_ms.push_back(1e3 * opening.open_s);
      tick_ms.push_back(1e3 * opening.first_tick_s);
    }
    opens.push_back(percentile(open_ms, 0.5));
    ticks.push_back(percentile(tick_ms, 0.5));
    const auto count = static_cast<std::int64_t>(set->counts().segments);
    const auto segments = static_cast<double>(count);
    report.samples.push_back({table.name, {count}, "open ms", "ms", false, open_ms});
    report.samples.push_back({table.name, {count}, "first tick ms", "ms", false, tick_ms});
    table.rows.push_back({count, std::int64_t{set->tile_count()}, opens.back(), percentile(open_ms, 0.9), ticks.back(),
                          percentile(tick_ms, 0.9)});
    const auto detail = Levels::open(*set);
    bytes_per_segment = static_cast<double>(set->bytes()) / segments;
    LevelEntry coarsest;
    if (detail->size() > 0) coarsest = detail->entry(0);
    levels.rows.push_back({static_cast<std::int64_t>(set->counts().segments), std::int64_t{detail->size()},
                           1e6 * (made.cpu_s - bare.cpu_s) / segments, bytes_per_segment,
                           static_cast<double>(detail->bytes()) / segments, std::int64_t{coarsest.segments},
                           coarsest.error_um, static_cast<std::int64_t>(coarsest.hidden)});
  }
  const auto flat = [](const std::vector<double>& ms) {
    return *std::max_element(ms.begin(), ms.end()) / *std::min_element(ms.begin(), ms.end());
  };
  const auto goal = [&](const std::string& what, const std::string& must, const std::string& aim, double measured,
                        double at_most, double aim_at_most) {
    report.goals.push_back({what, must, aim, measured, measured <= at_most, measured <= aim_at_most});
  };
  goal("opening the largest set, ms", "<= 20", "5", opens.back(), 20, 5);
  goal("first constrained tick in the largest, ms", "<= 50", "10", ticks.back(), 50, 10);
  goal("opening, largest against smallest", "<= 2 times", "", flat(opens), 2, 2);
  goal("first tick, largest against smallest", "<= 2 times", "", flat(ticks), 2, 2);
  goal("bytes a segment with levels", "<= 12", "9", bytes_per_segment, 12, 9);
  report.tables.push_back(std::move(table));
  report.tables.push_back(std::move(levels));
}

// ---- frontiers

RunOptions tourOptions(const BenchOptions& options, double seconds) {
  RunOptions run;
  run.route = {.kind = RouteChoice::Kind::tour, .seed = options.seed};
  run.seconds = seconds;
  run.person.speed_m_s = 0.5;
  return run;
}

const char* policyName(PrefetchPolicy policy) {
  return policy == PrefetchPolicy::none ? "none" : policy == PrefetchPolicy::distance ? "distance" : "structure";
}

struct Waiting {  // parameters of a tour
  double latency_ms, speed_m_s;
  double floors;  // the budget, in multiples of the smallest possible; infinite: no budget
};

void measureFrontiers(const BenchOptions& options, const TileSet& set, BenchReport& report) {
  BenchTable table{"frontiers",
                   "Ticks at which the proxy waited for an absent tile; tour, virtual time; the first budget is the "
                   "smallest possible, the last takes the whole set",
                   {"latency ms", "speed m/s", "budget MiB", "prefetch", "frontiers", "ticks", "jumps waited for",
                    "unforeseen", "no room", "late", "evicted", "tiles read", "foreseen used", "wasted"},
                   {},
                   {"latency ms", "speed m/s", "budget MiB", "prefetch"}};
  const double seconds = options.quick ? 1 : options.long_run ? 20 : 5;
  const auto floor = static_cast<double>(Residency::floorBytes(set));
  double whole = 0;
  for (TileId id = 0; id < set.tile_count(); ++id) whole += static_cast<double>(set.entry(id).decoded_bytes);
  const auto travelled = [&](const Waiting& how, PrefetchPolicy policy) {
    const double budget = std::isinf(how.floors) ? 2 * whole : how.floors * floor;
    std::vector<BenchValue> row{how.latency_ms, how.speed_m_s, budget / kMiB, std::string(policyName(policy))};
    // The middle belongs to every sweep. In virtual time its result is always the same.
    for (const auto& known : table.rows)
      if (std::equal(row.begin(), row.end(), known.begin()))
        return 1e3 * static_cast<double>(std::get<std::int64_t>(known[4])) /
               static_cast<double>(std::get<std::int64_t>(known[5]));
    options.progress("frontiers at " + shown(how.latency_ms) + " ms, " + shown(how.speed_m_s) + " m/s, " +
                     shown(budget / kMiB) + " MiB, " + policyName(policy));
    RunOptions run_options = tourOptions(options, seconds);
    run_options.person.speed_m_s = how.speed_m_s;
    run_options.latency_ms = how.latency_ms;
    run_options.budget_bytes = static_cast<std::uint64_t>(budget);
    run_options.prefetch = policy;
    const RunSummary s = run(set, run_options);
    const ResidencyCounters& c = s.streaming;
    row.insert(row.end(), {static_cast<std::int64_t>(s.frontiers), static_cast<std::int64_t>(s.ticks),
                           static_cast<std::int64_t>(s.jump_wait_ticks), static_cast<std::int64_t>(c.missed_unclaimed),
                           static_cast<std::int64_t>(c.missed_full), static_cast<std::int64_t>(c.missed_late),
                           static_cast<std::int64_t>(c.missed_evicted), static_cast<std::int64_t>(c.reads),
                           static_cast<std::int64_t>(c.prefetch_used), static_cast<std::int64_t>(c.prefetch_wasted)});
    table.rows.push_back(std::move(row));
    return 1e3 * static_cast<double>(s.frontiers) / static_cast<double>(s.ticks);
  };
  // One of the three parameters varies at a time; the others have these values.
  const Waiting middle{20, 0.5, 8};
  constexpr PrefetchPolicy kPolicies[] = {PrefetchPolicy::none, PrefetchPolicy::distance, PrefetchPolicy::structure};
  const PrefetchPolicy standard = ResidencyOptions{}.prefetch;
  const auto sweep = [&](const std::vector<Waiting>& all, const std::function<double(const Waiting&)>& x) {
    std::vector<PlotSeries> series;
    for (const PrefetchPolicy policy : kPolicies) {
      PlotSeries one{std::string("prefetch ") + policyName(policy) + (policy == standard ? " (default)" : ""), {}, {}};
      for (const Waiting& how : all) one.x.push_back(x(how)), one.y.push_back(travelled(how, policy));
      series.push_back(std::move(one));
    }
    return series;
  };
  const auto found = [&](BenchCurve& curve) {
    const auto& all = curve.plot.series;
    std::string text;
    for (const PlotSeries& one : all)
      text += (text.empty() ? "Frontiers in 1000 ticks from left to right: " : "; ") + one.name + " " +
              shown(one.y.front()) + " to " + shown(one.y.back());
    // Of the curve without prefetch: the default usually has no knee.
    const auto knee = kneeOf(all[0].x, all[0].y, curve.plot.x_log, curve.plot.y_log);
    if (knee) addLine(curve, all[0].x[*knee], "knee without prefetch");
    text += std::string(knee ? "; without prefetch the knee is at " + shown(all[0].x[*knee]) : "; no knee") + ". ";
    return text;
  };
  std::vector<Waiting> budgets, latencies, speeds;
  for (const double floors : {1.0, 1.5, 2.0, 4.0, 8.0, 16.0, double{INFINITY}})
    if (!options.quick || floors == 1 || floors == 8 || std::isinf(floors)) budgets.push_back({20, 0.5, floors});
  for (const double ms : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0})
    if (!options.quick || ms == 5 || ms == 20 || ms == 100) latencies.push_back({ms, middle.speed_m_s, middle.floors});
  for (const double speed : {0.05, 0.1, 0.2, 0.5, 1.0})
    if (!options.quick || speed == 0.2) speeds.push_back({middle.latency_ms, speed, middle.floors});

  BenchCurve by_budget = tradeCurve(
      "budget", "Memory budget: ticks that wait for a tile, 20 ms a tile, 0.5 m/s", "budget (MiB)",
      "frontiers in 1000 ticks",
      sweep(budgets,
            [&](const Waiting& how) { return (std::isinf(how.floors) ? 2 * whole : how.floors * floor) / kMiB; }),
      true, false);
  double distance = 0, structure = 0;
  for (std::size_t i = 0; i < budgets.size(); ++i) {
    if (budgets[i].floors < 2) continue;
    distance += by_budget.plot.series[1].y[i];
    structure += by_budget.plot.series[2].y[i];
  }
  addLine(by_budget, by_budget.plot.series[0].x.back(), "exact, default: all that was visited stays");
  by_budget.finding =
      found(by_budget) + "The smallest budget that is accepted is the first point. The default is none.";
  report.curves.push_back(std::move(by_budget));
  BenchCurve by_latency = tradeCurve(
      "latency", "Latency: ticks that wait for a tile, budget 8 times the smallest, 0.5 m/s", "latency of a tile (ms)",
      "frontiers in 1000 ticks", sweep(latencies, [](const Waiting& how) { return how.latency_ms; }), true, false);
  by_latency.finding = found(by_latency) + "The latency is the disk's, not chosen; prefetch is what makes up for it.";
  report.curves.push_back(std::move(by_latency));
  BenchCurve by_speed = tradeCurve("speed", "Speed of the hand: ticks that wait for a tile, 20 ms a tile",
                                   "speed of the hand (m/s)", "frontiers in 1000 ticks",
                                   sweep(speeds, [](const Waiting& how) { return how.speed_m_s; }), true, false);
  by_speed.finding = found(by_speed) + "Prefetch by structure is the default.";
  report.curves.push_back(std::move(by_speed));
  if (options.long_run)  // every combination
    for (const Waiting& latency : latencies)
      for (const Waiting& speed : speeds)
        for (const Waiting& budget : budgets)
          for (const PrefetchPolicy policy : kPolicies)
            travelled({latency.latency_ms, speed.speed_m_s, budget.floors}, policy);
  const double ratio = distance > 0 ? structure / distance : structure;
  report.goals.push_back({"frontiers at 20 ms and 0.5 m/s, structure against distance, budgets from twice the smallest",
                          "<= 1/3", "1/10", ratio, ratio <= 1.0 / 3, ratio <= 0.1});
  report.tables.push_back(std::move(table));
}

void measureRealTime(const BenchOptions& options, const TileSet& set, BenchReport& report) {
  BenchTable table{"real_time",
                   "A tour at 0.5 m/s in real time, files in the page cache, prefetch by structure",
                   {"budget MiB", "seconds", "frontiers", "missed deadlines", "jumps", "ticks waited for jumps",
                    "unforeseen", "no room", "late", "evicted", "tiles read", "wait mean ms", "wait most ms"},
                   {}};
  const double seconds = options.quick ? 1 : options.long_run ? 30 : 10;
  for (const std::uint64_t budget : {64 * kMiB, 16 * kMiB}) {
    options.progress("real time, " + std::to_string(budget / kMiB) + " MiB");
    RunOptions run_options = tourOptions(options, seconds);
    run_options.budget_bytes = std::max(budget, Residency::floorBytes(set));
    run_options.realtime = true;
    const RunSummary s = run(set, run_options);
    const ResidencyCounters& c = s.streaming;
    table.rows.push_back(
        {static_cast<double>(*run_options.budget_bytes) / kMiB, s.sim_s, static_cast<std::int64_t>(s.frontiers),
         static_cast<std::int64_t>(s.missed_deadlines.value_or(0)), static_cast<std::int64_t>(s.jumps),
         static_cast<std::int64_t>(s.jump_wait_ticks), static_cast<std::int64_t>(c.missed_unclaimed),
         static_cast<std::int64_t>(c.missed_full), static_cast<std::int64_t>(c.missed_late),
         static_cast<std::int64_t>(c.missed_evicted), static_cast<std::int64_t>(c.reads),
         1e3 * c.wait_sum / static_cast<double>(std::max<std::uint64_t>(1, c.waits)), 1e3 * c.wait_most});
    const bool none = s.frontiers == 0;
    report.goals.push_back({"frontiers in real time at " + std::to_string(budget / kMiB) + " MiB",
                            budget > 16 * kMiB ? "0" : "", "0", static_cast<double>(s.frontiers),
                            none || budget == 16 * kMiB, none});
  }
  report.tables.push_back(std::move(table));
}

// ---- the loader

void measureLoader(const BenchOptions& options, const std::string& path, BenchReport& report) {
  BenchTable table{"loader",
                   "Loading as fast as the loader can: read, check, decode, hand over",
                   {"latency ms", "IO threads", "tiles", "tiles a s", "MiB a s decoded"},
                   {},
                   {"latency ms", "IO threads"}};
  struct Row {
    double latency_ms;
    unsigned threads;
  };
  const std::vector<Row> rows =
      options.quick ? std::vector<Row>{{0, 1}, {5, 4}} : std::vector<Row>{{0, 1}, {0, 2}, {20, 1}, {20, 4}, {20, 16}};
  for (const Row& row : rows) {
    options.progress("loader, " + std::to_string(row.threads) + " threads");
    FaultPlan plan;
    plan.delay = FaultPlan::Delay::constant;
    plan.delay_s = 1e-3 * row.latency_ms;
    auto source = std::make_unique<FaultySource>(openFolder(path), plan);
    FaultySource& slow = *source;
    const auto set = TileSet::open(std::move(source));
    if (row.latency_ms > 0) slow.arm();
    ResidencyOptions residency_options;
    residency_options.io_threads = row.threads;
    residency_options.prefetch = PrefetchPolicy::distance;
    Residency residency(*set, residency_options);
    TileReader& reader = residency.addReader("hand");
    ReaderFocus focus;
    focus.p_W = 0.5 * (set->grid().toWorld(set->bounds().lo) + set->grid().toWorld(set->bounds().hi));
    focus.radius_um = 1e9;
    const auto start = Clock::now();
    reader.publishFocus(focus);
    residency.start();
    const std::size_t most = std::min<std::size_t>(set->tile_count(), 4000);
    while (reader.tiles().size() < most && since(start) < 3) {
      reader.apply();
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    const double took_s = since(start);
    residency.stop();
    const ResidencyCounters c = residency.counters();
    table.rows.push_back({row.latency_ms, std::int64_t{row.threads}, static_cast<std::int64_t>(c.reads),
                          static_cast<double>(c.reads) / took_s,
                          static_cast<double>(c.bytes_read_decoded) / kMiB / took_s});
  }
  report.tables.push_back(std::move(table));
}

BenchReport streaming(const BenchOptions& options) {
  BenchReport report;
  std::vector<std::uint64_t> sizes =
      options.quick ? std::vector<std::uint64_t>{30'000, 100'000} : std::vector<std::uint64_t>{300'000, 1'000'000};
  if (options.segments > 0) {
    std::erase_if(sizes, [&](std::uint64_t n) { return n >= options.segments; });
    for (std::uint64_t n = 3'000'000; n < options.segments; n = 10'000'000 * (n / 3'000'000)) sizes.push_back(n);
    sizes.push_back(options.segments);
  }
  const Sets sets(options);
  std::vector<std::string> paths;
  measureOpening(options, sets, sizes, paths, report);
  const auto set = TileSet::open(paths.back());
  measureFrontiers(options, *set, report);
  measureRealTime(options, *set, report);
  measureLoader(options, paths.back(), report);
  report.notes.push_back("The column has one size: with more segments it is denser, and its tiles are smaller. Here " +
                         std::to_string(set->counts().segments) + " segments in " + std::to_string(set->tile_count()) +
                         " tiles.");
  report.notes.push_back("A jump waits until its target's tiles are there; that is no frontier, and counted apart.");
  return report;
}

}  // namespace

void addStreamingWorkloads(std::vector<Workload>& all) {
  all.push_back(
      {"streaming", "opening a set, frontiers, and the loader, against size, budget, latency and speed", streaming});
}

}  // namespace filiform::tools
