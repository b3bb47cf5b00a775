// bench loop: how regular the haptic loop is while tiles are read. Compared with a loop that does nothing and with a
// loop that only computes sums: the latter shows what the machine takes from any computation.
#include "device/factory/device_factory.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "index/streaming/residency.h"
#include "solver/loop/haptic_loop.h"
#include "solver/travel/run/run.h"
#include "tools/lab/bench/workloads.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;

constexpr const char* kHand = "sim:firm";
constexpr double kSums_s = 8e-6;  // about the time of a navigation tick at 1 kHz

// The times of one kind of loop, over all its turns.
struct Times {
  TimeHistogram wake, compute, exchange, period;
  std::uint64_t ticks = 0, missed = 0, interruptions = 0;

  void add(const LoopMetrics& metrics, std::uint64_t interrupted) {
    wake.add(metrics.wake());
    compute.add(metrics.compute());
    exchange.add(metrics.exchange());
    period.add(metrics.period());
    ticks += metrics.ticks();
    missed += metrics.missed_deadlines();
    interruptions += interrupted;
  }
};

// A computation in which each step needs the step before. The result is returned so that it must be computed.
double sums(std::int64_t steps) {
  double x = 1;
  for (std::int64_t i = 0; i < steps; ++i) x = x * 1.0000001 + 1e-9;
  return x;
}

// The number of steps of sums() in a time, by the fastest of some tries.
std::int64_t stepsIn(double seconds) {
  constexpr std::int64_t kSteps = 100'000;
  double fastest_s = 1;
  volatile double kept = 0;
  for (int i = 0; i < 20; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    kept = sums(kSteps);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    fastest_s = std::min(fastest_s, took.count());
  }
  static_cast<void>(kept);
  return static_cast<std::int64_t>(seconds / fastest_s * kSteps);
}

void runBare(double seconds, std::int64_t steps, Times& times, std::vector<std::string>& refusals) {
  const auto device = makeDevice(kHand);
  device->open();
  HapticLoop loop(*device, [steps](const DeviceState&, double) {
    volatile double kept = sums(steps);
    static_cast<void>(kept);
    return Wrench{};
  });
  loop.start();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  loop.stop();
  device->close();
  times.add(loop.metrics(), loop.interruptions());
  refusals = loop.refusals();
}

class LoopScene {
 public:
  explicit LoopScene(const BenchOptions& options) {
    if (!options.scene.empty()) {
      set_ = TileSet::open(options.scene);
      return;
    }
    folder_ = options.out + "/loop.tmp-" + std::to_string(::getpid());
    fs::create_directories(folder_);
    const std::uint64_t segments = options.segments > 0 ? options.segments : options.quick ? 20'000 : 1'000'000;
    measureInChild([&] {
      SyntheticOptions column;
      column.cells = static_cast<std::uint32_t>(std::max(2.0, static_cast<double>(segments) / kSegmentsPerCell));
      column.seed = options.seed;
      SyntheticCells cells(column);
      ingest(cells, folder_ + "/loop.fil", {});
      return std::vector<double>{};
    });
    set_ = TileSet::open(folder_ + "/loop.fil");
  }
  ~LoopScene() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  LoopScene(const LoopScene&) = delete;
  LoopScene& operator=(const LoopScene&) = delete;
  const TileSet& set() const { return *set_; }

 private:
  std::string folder_;
  std::unique_ptr<TileSet> set_;
};

BenchReport runLoop(const BenchOptions& options) {
  BenchReport report;
  options.progress("making the set");
  const LoopScene scene(options);
  const double whole_s = options.quick ? 0.5 : options.long_run ? 600 : 10;
  const int turns = options.quick ? 1 : options.long_run ? 20 : 2;
  const double turn_s = whole_s / turns;
  const std::uint64_t budget = std::max<std::uint64_t>(16 << 20, 2 * Residency::floorBytes(scene.set()));

  const std::int64_t steps = stepsIn(kSums_s);
  Times bare, summing, navigation;
  std::vector<std::string> refusals;
  std::uint64_t frontiers = 0, jumps = 0, tiles_read = 0;
  double max_force_N = 0, max_force_step_N = 0;
  bool finite = true;
  for (int turn = 0; turn < turns; ++turn) {
    const std::string which = "turn " + std::to_string(turn + 1) + " of " + std::to_string(turns) + ": ";
    options.progress(which + "bare loop");
    runBare(turn_s, 0, bare, refusals);
    options.progress(which + "sums");
    runBare(turn_s, steps, summing, refusals);
    options.progress(which + "navigation");
    RunOptions run_options;
    run_options.device = kHand;
    run_options.route = {.kind = RouteChoice::Kind::tour, .seed = options.seed + static_cast<std::uint64_t>(turn)};
    run_options.seconds = turn_s;
    run_options.realtime = true;
    run_options.budget_bytes = budget;
    const RunSummary summary = run(scene.set(), run_options, [&](const TickRow& row) {
      finite = finite && row.force_N.allFinite();
      if (row.tick % 1000 == 0) options.progress("navigation, " + std::to_string(row.tick) + " ticks");
    });
    navigation.add(summary.loop->metrics, summary.loop->interruptions);
    frontiers += summary.frontiers;
    jumps += summary.jumps;
    tiles_read += summary.tiles_read;
    max_force_N = std::max(max_force_N, summary.max_force_N);
    max_force_step_N = std::max(max_force_step_N, summary.max_force_step_N);
  }

  BenchTable table{"times",
                   "The haptic loop at 1 kHz, " + shown(BenchValue(whole_s)) +
                       " s of each, by turns; us (wake: later than scheduled)",
                   {"loop", "what", "p50", "p99", "p99.9", "p99.99", "most"},
                   {},
                   {"loop", "what"}};
  const auto rows = [&](const std::string& name, const Times& times) {
    const auto row = [&](const std::string& what, const TimeHistogram& histogram) {
      const auto us = [](std::int64_t ns) { return 1e-3 * static_cast<double>(ns); };
      table.rows.push_back({name, what, us(histogram.percentile_ns(0.5)), us(histogram.percentile_ns(0.99)),
                            us(histogram.percentile_ns(0.999)), us(histogram.percentile_ns(0.9999)),
                            us(histogram.max_ns())});
    };
    row("wake", times.wake);
    row("compute", times.compute);
    row("exchange", times.exchange);
    row("period", times.period);
  };
  rows("bare", bare);
  rows("sums", summing);
  rows("navigation", navigation);
  report.tables.push_back(std::move(table));
  BenchTable counts{"counts",
                    "The same: ticks that ended after the next was due, and forces that came too late to be sent",
                    {"loop", "ticks", "missed", "interrupted"},
                    {}};
  for (const auto& [name, times] :
       {std::pair("bare", &bare), std::pair("sums", &summing), std::pair("navigation", &navigation)})
    counts.rows.push_back({std::string(name), static_cast<std::int64_t>(times->ticks),
                           static_cast<std::int64_t>(times->missed), static_cast<std::int64_t>(times->interruptions)});
  report.tables.push_back(std::move(counts));

  const double compute_us = 1e-3 * static_cast<double>(navigation.compute.percentile_ns(0.9999));
  report.goals.push_back(
      {"navigation's compute time, p99.99, us", "<= 50", "", compute_us, compute_us <= 50, compute_us <= 50});
  const auto share = [](const Times& times) {
    return times.ticks > 0 ? static_cast<double>(times.missed) / static_cast<double>(times.ticks) : 0.0;
  };
  const double more = share(navigation) - share(bare);
  report.goals.push_back(
      {"share of deadlines missed beyond the bare loop's", "<= 0.001", "0", more, more <= 0.001, more <= 0});
  report.goals.push_back({"largest force, N (the clamp is 8)", "<= 8", "", max_force_N,
                          finite && max_force_N <= 8 + 1e-12, finite && max_force_N <= 8 + 1e-12});
  report.notes.push_back(std::to_string(scene.set().counts().segments) + " segments, tile budget " +
                         std::to_string(budget >> 20) + " MiB: " + std::to_string(tiles_read) + " tiles read, " +
                         std::to_string(jumps) + " jumps, " + std::to_string(frontiers) +
                         " frontiers; largest force step " + shown(BenchValue(max_force_step_N)) + " N");
  report.notes.push_back("sums: " + std::to_string(steps) +
                         " dependent steps a tick, 8 us of an idle core; what its times exceed this by is "
                         "the machine's");
  for (const std::string& refusal : refusals) report.notes.push_back(refusal);
  return report;
}

}  // namespace

void addLoopWorkloads(std::vector<Workload>& all) {
  all.push_back({"loop", "the haptic loop in real time beside a bare one: wake, compute, missed deadlines", runLoop});
}

}  // namespace filiform::tools
