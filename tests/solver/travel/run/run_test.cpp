#include "solver/travel/run/run.h"

#include "device/haptic_device.h"
#include "device/recording/internal/recording_format.h"
#include "device/recording/replay.h"
#include "device/simulated/null_device.h"
#include "index/errors.h"
#include "tests/support/devices/paced_device.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/recorded_run.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::column;
using test::line;
using test::record;
using test::Recorded;
using test::shortRun;
using test::storeOf;
using test::straightNeurite;

TEST(Run, BudgetDoesNotChangeABit) {
  const auto store = column();
  for (const SolverMethod method : kSolverMethods) {
    RunOptions options = shortRun();
    options.method = method;
    options.in_memory = true;
    const Recorded whole = record(*store, options);
    EXPECT_EQ(whole.summary.evictions, 0u);
    EXPECT_EQ(whole.summary.tiles_read, 0u);
    EXPECT_EQ(whole.summary.stalls, 0u);
    ASSERT_GT(whole.rows.size(), 1000u);
    options.in_memory = false;
    const Recorded unlimited = record(*store, options);
    EXPECT_EQ(unlimited.summary.evictions, 0u);
    EXPECT_GT(unlimited.summary.stalls, 0u);
    ASSERT_EQ(unlimited.rows, whole.rows);
    options.budget_bytes = Residency::floorBytes(*store);
    const Recorded floor = record(*store, options);
    EXPECT_GT(floor.summary.evictions, 0u);
    EXPECT_EQ(floor.summary.frontiers, 0u);
    EXPECT_LE(floor.summary.peak_bytes, *options.budget_bytes);
    ASSERT_EQ(floor.rows, whole.rows);
    EXPECT_EQ(floor.summary.outcome, whole.summary.outcome);
    EXPECT_EQ(floor.summary.reached_um, whole.summary.reached_um);
    EXPECT_EQ(floor.summary.tiles, whole.summary.tiles);
    EXPECT_GT(floor.summary.tiles, 3u);
    EXPECT_GE(floor.summary.tiles_read, floor.summary.tiles);
  }
}

TEST(Run, LatencyChangesNothingBeforeTheFirstFrontier) {
  const auto store = column();
  RunOptions options = shortRun();
  options.in_memory = true;
  const Recorded whole = record(*store, options);
  options.in_memory = false;
  for (const PrefetchPolicy prefetch : {PrefetchPolicy::none, PrefetchPolicy::distance, PrefetchPolicy::structure}) {
    options.prefetch = prefetch;
    options.latency_ms = 40;
    const Recorded late = record(*store, options);
    std::size_t first = 0;
    while (first < late.rows.size() && !late.frontier[first]) ++first;
    ASSERT_LE(first, whole.rows.size());
    for (std::size_t row = 0; row < first; ++row) ASSERT_EQ(late.rows[row], whole.rows[row]);
    EXPECT_EQ(late.summary.stalls, 0u);
    EXPECT_EQ(late.summary.frontiers,
              static_cast<std::uint64_t>(std::count(late.frontier.begin(), late.frontier.end(), true)));
    if (prefetch == PrefetchPolicy::none) {
      EXPECT_GT(late.summary.frontiers, 39u);  // the proxy waits for each absent tile
    }
    if (late.summary.frontiers == 0) {
      EXPECT_EQ(late.rows, whole.rows);
    }
    const Recorded again = record(*store, options);
    EXPECT_EQ(again.rows, late.rows);
  }
}

TEST(Run, CompletesAStraightNeurite) {
  const auto store = straightNeurite();
  for (const char* device : {"sim:loose", "sim:medium", "sim:firm"}) {
    RunOptions options;
    options.device = device;
    options.in_memory = true;
    const Recorded recorded = record(*store, options);
    const RunSummary& s = recorded.summary;
    EXPECT_EQ(s.outcome, RunOutcome::completed) << device;
    EXPECT_DOUBLE_EQ(s.route_um, 59 * 2.0);
    EXPECT_NEAR(s.reached_um, s.route_um, 0.0005 * 300 / 0.12 * 1.01);
    EXPECT_EQ(s.ticks, recorded.rows.size());
    EXPECT_NEAR(s.sim_s, static_cast<double>(s.ticks) * 1e-3, 1e-9);
    EXPECT_EQ(s.segments, 59u);
    EXPECT_EQ(s.frontiers, 0u);
    EXPECT_FALSE(s.missed_deadlines.has_value());
    EXPECT_EQ(s.stiffness_N_m, std::string(device) == "sim:loose" ? 50 : 200);
    EXPECT_GT(s.mean_force_N, 0);
    EXPECT_GE(s.max_force_N, s.mean_force_N);
    EXPECT_LE(s.max_force_N, 8 * (1 + 1e-12));
    EXPECT_NEAR(s.force_integral_Ns, s.mean_force_N * s.sim_s, 1e-9 + 1e-9 * s.force_integral_Ns);
    EXPECT_GE(s.visited, s.ticks);
    EXPECT_TRUE(s.notes.empty());
  }
}

TEST(Run, DependsOnTheSeed) {
  const auto store = straightNeurite();
  RunOptions options;
  options.in_memory = true;
  options.seconds = 0.5;
  const Recorded a = record(*store, options), b = record(*store, options);
  EXPECT_EQ(a.rows, b.rows);
  options.seed = 2;
  EXPECT_NE(record(*store, options).rows, a.rows);
}

TEST(Run, StopsWhenTimeIsOver) {
  const auto store = straightNeurite(2000);
  RunOptions options;
  options.in_memory = true;
  options.seconds = 0.25;
  const Recorded recorded = record(*store, options);
  EXPECT_EQ(recorded.summary.outcome, RunOutcome::time_over);
  EXPECT_EQ(recorded.rows.size(), 250u);
  EXPECT_GT(recorded.summary.reached_um, 0);
  EXPECT_LT(recorded.summary.reached_um, recorded.summary.route_um);
}

TEST(Run, SaysHowItEnded) {
  EXPECT_STREQ(toString(RunOutcome::completed), "completed");
  EXPECT_STREQ(toString(RunOutcome::stuck), "stuck");
  EXPECT_STREQ(toString(RunOutcome::time_over), "time_over");
  EXPECT_STREQ(toString(RunOutcome::interrupted), "interrupted");

  const auto store = straightNeurite(2000);
  RunOptions options;
  options.in_memory = true;
  options.person.speed_m_s = 1e-6;  // practically no progress
  options.person.stuck_after_s = options.person.hold_s = options.person.back_off_s = 0.02;
  options.person.push_most_m = 1e-6;
  options.person.tries = 1;
  EXPECT_EQ(record(*store, options).summary.outcome, RunOutcome::stuck);

  std::atomic<bool> stop{true};
  options.stop = &stop;
  const RunSummary at_once = record(*store, options).summary;
  EXPECT_EQ(at_once.outcome, RunOutcome::interrupted);
  EXPECT_EQ(at_once.ticks, 0u);
  for (const bool realtime : {false, true}) {
    RunOptions tour;
    tour.in_memory = true;
    tour.route = routeChoiceOf("tour:1");
    tour.seconds = 1e6;
    tour.realtime = realtime;
    tour.stop = &stop;
    stop = false;
    std::uint64_t ticks = 0;
    const RunSummary summary = run(*store, tour, [&](const TickRow&) { stop = ++ticks >= 100; });
    EXPECT_EQ(summary.outcome, RunOutcome::interrupted);
    EXPECT_GE(summary.ticks, 100u);
  }
}

// At this zoom a hand at the first point would count as arrived at the last one.
TEST(Run, NoTravelSucceedsWhereTheHandHasArrivedBeforeItMoves) {
  const auto store = straightNeurite(60);
  RunOptions options;
  options.in_memory = true;
  for (const double zoom_um : {3e4, 3e5, 1e6, 1.1e6, 1e300, 1e-7, 0.0})
    for (const char* route : {"longest", "tour:1"}) {
      options.zoom_um = zoom_um;
      options.route = routeChoiceOf(route);
      EXPECT_THROW(run(*store, options), UsageError) << zoom_um << route;
    }
  options.zoom_um = 2e4;
  options.route = routeChoiceOf("longest");
  const RunSummary moved = run(*store, options);
  EXPECT_EQ(moved.outcome, RunOutcome::completed);
  EXPECT_GT(moved.reached_um, 0);
}

TEST(Run, AFailureIsToldWithTheFiguresSoFarAfterTheRecordingIsWritten) {
  const test::TempFolder folder;
  const auto store = straightNeurite(2000);
  for (const bool realtime : {false, true}) {
    RunOptions options;
    options.in_memory = true;
    options.realtime = realtime;
    options.record = folder / "a.rec";
    RunSummary told;
    options.ending = [&](const RunSummary& so_far) {
      told = so_far;
      EXPECT_EQ(std::filesystem::exists(options.record), so_far.ticks > 0);
    };
    const auto failing = [&](const TickRow& row) {
      if (row.tick == 100) throw IoError("rows", "cannot write");
    };
    EXPECT_THROW(run(*store, options, failing), IoError);
    EXPECT_EQ(told.outcome, RunOutcome::failed);
    EXPECT_NE(told.error.find("rows: cannot write"), std::string::npos) << told.error;
    EXPECT_GE(told.ticks, 101U);
    EXPECT_GE(ReplayDevice(options.record).exchanges(), 101U);
    std::filesystem::remove(options.record);
  }
}

TEST(Run, AFaultOfTheDeviceLeavesTheLastTicks) {
  const test::TempFolder folder;
  const auto store = column();
  // A recording that ends in a fault behaves like a device that is lost.
  class Dying : public NullDevice {
   public:
    DeviceState exchange(const Wrench& wrench) noexcept override {
      DeviceState state = NullDevice::exchange(wrench);
      if (++exchanges_ > 100) state.status = DeviceStatus::fault;
      return state;
    }

   private:
    int exchanges_ = 0;
  };
  std::ofstream file(folder.file("r.rec"), std::ios::binary);
  RecordingDevice recording(std::make_unique<Dying>(), file);
  recording.open();
  for (int i = 0; i < 110; ++i) recording.exchange({});
  recording.finish();
  RunOptions options = shortRun();
  options.device = "replay:" + folder.file("r.rec");
  options.realtime = true;
  options.fault_csv = folder.file("fault.csv");
  try {
    record(*store, options);
    ADD_FAILURE() << "the fault was not reported";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find(options.fault_csv), std::string::npos) << error.what();
  }
  const std::string csv = test::readBytes(options.fault_csv);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 101);
}

TEST(Run, WhileTheSourceFailsTheHandIsSentNoForce) {
  const test::TempFolder folder;
  const auto store = straightNeurite();
  test::CountingStore failing(*store);
  const TileId lost = store->leaves().home(store->grid().snap({60, 0, 0}));
  RunOptions options;
  options.realtime = true;
  options.seconds = 3;
  options.prefetch = PrefetchPolicy::none;
  options.record = folder.file("r.rec");
  std::vector<double> computed_N;
  const RunSummary summary = run(failing, options, [&](const TickRow& row) {
    if (row.tick == 0) failing.failLoads(lost);  // after the route was planned
    computed_N.push_back(row.force_N.norm());
  });
  EXPECT_GT(summary.frontiers, 100u);
  EXPECT_FALSE(summary.failures.empty());
  const std::string bytes = test::readBytes(options.record);
  internal::RecordingHeader header;
  std::size_t at = internal::readHeader("r", bytes, header);
  std::vector<double> sent_N;
  internal::RecordedExchange exchange;
  for (; bytes.size() - at >= internal::kExchangeBytes; at += internal::kExchangeBytes)
    if (internal::readExchange(std::string_view(bytes).substr(at), sent_N.size(), exchange, false))
      sent_N.push_back(exchange.wrench.force_N.norm());
  ASSERT_GT(sent_N.size(), 2500u);
  // Navigation computed a force before and while the proxy rested, but the device was not sent it.
  EXPECT_GT(*std::max_element(sent_N.begin(), sent_N.begin() + 1000), 0.01);
  EXPECT_GT(computed_N.back(), 0.05);
  // Whenever the tile is tried again, the force may begin to grow until the read fails.
  EXPECT_GT(std::count(sent_N.begin() + 2000, sent_N.begin() + 2500, 0.0), 400);
  for (std::size_t i = 2000; i < 2500; ++i) EXPECT_LT(sent_N[i], 0.5 * computed_N[i]);
}

// A device that paces the loop at 500 Hz, while 1 kHz is requested: ramp, time and integral use the device's clock.
TEST(Run, TimeGoesByTheDevicesClock) {
  const test::TempFolder folder;
  const auto store = straightNeurite();
  RunOptions options;
  options.in_memory = true;
  options.realtime = true;
  options.seconds = 1;
  options.record = folder.file("r.rec");
  options.device = "paced";
  options.make_device = [](const std::string&, double) {
    return std::make_unique<test::PacedDevice>(0.002, Vector3d(0, 0.005, 0));
  };
  std::vector<TickRow> rows;
  std::vector<std::string> lines;
  const RunSummary summary = run(*store, options, [&](const TickRow& row) {
    rows.push_back(row);
    std::ostringstream line;
    writeCsvRow(line, row);
    lines.push_back(line.str());
  });
  EXPECT_NEAR(static_cast<double>(summary.ticks), 500, 2);
  EXPECT_NEAR(summary.sim_s, 1, 0.003);
  ASSERT_GT(rows.size(), 400u);
  for (const std::size_t tick : {100u, 200u, 400u}) {
    EXPECT_NEAR(rows[tick].time_s, 0.002 * static_cast<double>(tick), 0.002);
    EXPECT_NEAR(rows[tick].force_N.norm(), std::min(1.0, rows[tick].time_s / 0.5), 0.01);
  }
  EXPECT_NEAR(summary.force_integral_Ns, 0.75, 0.01);

  // The recording stores these times.
  RunOptions again = options;
  again.make_device = nullptr;
  again.realtime = false;
  again.device = "replay:" + options.record;
  again.record.clear();
  const Recorded replayed = record(*store, again);
  EXPECT_EQ(replayed.rows, lines);
  EXPECT_EQ(replayed.summary.sim_s, summary.sim_s);
}

TEST(Run, AtTheEndTheForceFades) {
  const auto store = straightNeurite();
  class Watching : public test::PacedDevice {
   public:
    explicit Watching(std::vector<double>& sent_N) : PacedDevice(0.001, {0, 0.005, 0}), sent_N_(sent_N) {}
    DeviceState exchange(const Wrench& wrench) noexcept override {
      if (sent_N_.size() < sent_N_.capacity()) sent_N_.push_back(wrench.force_N.norm());
      return PacedDevice::exchange(wrench);
    }

   private:
    std::vector<double>& sent_N_;
  };
  std::vector<double> sent_N;
  sent_N.reserve(1000);
  RunOptions options;
  options.in_memory = true;
  options.realtime = true;
  options.seconds = 0.7;
  options.device = "paced";
  options.make_device = [&](const std::string&, double) { return std::make_unique<Watching>(sent_N); };
  const RunSummary summary = run(*store, options);
  if (summary.loop->interruptions > 0) GTEST_SKIP() << "the machine held the loop up: its force was zero";
  ASSERT_GT(sent_N.size(), 700u);
  EXPECT_NEAR(sent_N[695], 1, 1e-6);
  EXPECT_NEAR(sent_N[705], 0.9, 0.05);
  // Meanwhile the loop itself may end, by the wall clock: then the force fades faster, but never steps up.
  for (std::size_t i = 701; i + 1 < sent_N.size(); ++i) EXPECT_LE(sent_N[i + 1], sent_N[i]);
}

TEST(Run, HardwareGetsTheStiffnessThatItCanRender) {
  const auto store = straightNeurite();
  for (const bool told : {false, true}) {
    RunOptions options;
    options.in_memory = true;
    options.realtime = true;
    options.seconds = 0.05;
    if (told) options.stiffness_N_m = 150;
    options.device = "paced";
    options.make_device = [](const std::string&, double) {
      auto device = std::make_unique<test::PacedDevice>(0.001, Vector3d::Zero());
      device->changeCapabilities().max_stiffness_N_m = 120;
      return device;
    };
    const RunSummary summary = run(*store, options);
    EXPECT_EQ(summary.stiffness_N_m, 120);
    const bool is_noted = std::any_of(summary.notes.begin(), summary.notes.end(), [](const std::string& note) {
      return note.find("stiffness lowered from 150 to 120 N/m") != std::string::npos;
    });
    EXPECT_EQ(is_noted, told);
  }
}

TEST(Run, SaysWhenTheStiffnessIsOutsideTheBound) {
  const auto store = straightNeurite();
  RunOptions options;
  options.in_memory = true;
  options.seconds = 0.01;
  options.stiffness_N_m = 4000;  // bound of the medium hand (b 5.5, T 1 ms, a delay of one period): 3667
  const RunSummary summary = run(*store, options);
  ASSERT_EQ(summary.notes.size(), 1u);
  EXPECT_NE(summary.notes[0].find("3667"), std::string::npos) << summary.notes[0];
}

TEST(Run, RealTimeTicksAndCountsMissedDeadlines) {
  const auto store = column();
  for (const bool in_memory : {false, true}) {
    RunOptions options = shortRun();
    options.realtime = true;
    options.in_memory = in_memory;
    options.seconds = 0.25;
    const Recorded recorded = record(*store, options);
    EXPECT_EQ(recorded.summary.ticks, 250u);
    EXPECT_EQ(recorded.rows.size(), 250u);
    ASSERT_TRUE(recorded.summary.missed_deadlines.has_value());
    EXPECT_LE(*recorded.summary.missed_deadlines, recorded.summary.ticks + 1);
    EXPECT_EQ(recorded.summary.stalls, 0u);
  }
}

TEST(Run, ADamagedTileEndsTheRun) {
  const auto store = column();
  test::CountingStore damaged(*store);
  RunOptions options = shortRun();
  options.solver = SolverParameters{};  // automatic parameters would read the tile first
  const Recorded sound = record(damaged, options);
  // Fails from its second load on: the first load belongs to the planning of the route.
  const TileId start = damaged.loads().back();
  test::CountingStore failing(*store);
  failing.failLoads(start);
  EXPECT_THROW(run(failing, options), CorruptTile);
}

TEST(Run, ExceptionsOfOnTickPropagate) {
  const auto store = column();
  for (const bool realtime : {false, true}) {
    RunOptions options = shortRun();
    options.realtime = realtime;
    EXPECT_THROW(run(*store, options, [](const TickRow&) { throw std::runtime_error("enough"); }), std::runtime_error);
  }
}

TEST(Run, RefusesWhatMakesNoSense) {
  const auto store = straightNeurite();
  const auto refuses = [&](auto change) {
    RunOptions options;
    change(options);
    EXPECT_THROW(run(*store, options), UsageError);
  };
  refuses([](RunOptions& o) { o.cell = 1; });
  refuses([](RunOptions& o) { o.cell = UINT32_MAX; });
  refuses([](RunOptions& o) { o.route = routeChoiceOf("1:999"); });
  refuses([](RunOptions& o) { o.budget_bytes = 1; });
  refuses([](RunOptions& o) { o.zoom_um = std::nan(""); });
  refuses([](RunOptions& o) { o.rate_Hz = 0; });
  refuses([](RunOptions& o) { o.seconds = -1; });
  refuses([](RunOptions& o) { o.latency_ms = -1; });
  refuses([](RunOptions& o) { o.stiffness_N_m = 0; });
  refuses([](RunOptions& o) { o.person.speed_m_s = 0; });
  refuses([](RunOptions& o) {
    o.realtime = true;
    o.latency_ms = 5;
  });
  refuses([](RunOptions& o) {
    o.route = routeChoiceOf("tour:1");
    o.device = "null";
  });
  RunOptions options;
  options.device = "sim:giant";
  EXPECT_THROW(run(*store, options), DeviceError);
  const auto empty = storeOf({}, 8);
  EXPECT_THROW(run(*empty, {}), UsageError);
}

TEST(Run, TakesTheCellOfMostSegmentsUnlessTold) {
  Cell small = line(10), big = line(20);
  small.source = "a.swc";
  big.source = "b.swc";
  const auto store = storeOf({small, big}, 8);
  RunOptions options;
  options.in_memory = true;
  options.seconds = 0.01;
  EXPECT_DOUBLE_EQ(run(*store, options).route_um, 38);
  options.cell = 0;
  EXPECT_DOUBLE_EQ(run(*store, options).route_um, 18);
}

}  // namespace
}  // namespace filiform
