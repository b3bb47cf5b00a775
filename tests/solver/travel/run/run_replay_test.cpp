#include "index/errors.h"
#include "solver/travel/routes/tour.h"
#include "solver/travel/run/recorded_options.h"
#include "solver/travel/run/run.h"
#include "solver/travel/session/session.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/recorded_run.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <string>
#include <unistd.h>
#include <utility>
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

TEST(Run, AnInterruptedRunLeavesAnOlderRecording) {
  const test::TempFolder folder;
  const auto store = straightNeurite(2000);
  test::writeBytes(folder.file("a.rec"), "old");
  std::atomic<bool> stop{false};
  std::string kept;
  RunOptions options;
  options.in_memory = true;
  options.record = folder.file("a.rec");
  options.stop = &stop;
  options.recording_kept = [&](const std::string& path) { kept = path; };
  std::uint64_t ticks = 0;
  run(*store, options, [&](const TickRow&) { stop = ++ticks >= 100; });
  EXPECT_EQ(test::readBytes(folder.file("a.rec")), "old");
  EXPECT_EQ(kept, folder.file("a.unfinished.rec"));
  options.device = "replay:" + kept;
  options.record.clear();
  options.stop = nullptr;
  EXPECT_EQ(record(*store, options).rows.size(), 100u);
}

TEST(Run, ReplayOfItsRecordingIsTheSameRun) {
  const std::string file =
      (std::filesystem::temp_directory_path() / ("filiform-run-" + std::to_string(getpid()) + ".rec")).string();
  const auto store = column();
  RunOptions options = shortRun();
  options.record = file;
  const Recorded live = record(*store, options);
  options.record.clear();
  options.device = "replay:" + file;
  const Recorded replayed = record(*store, options);
  std::filesystem::remove(file);
  EXPECT_EQ(replayed.rows, live.rows);
  EXPECT_EQ(replayed.summary.outcome, live.summary.outcome);
  EXPECT_TRUE(replayed.summary.notes.empty());
}

TEST(Run, ReplayTakesTheOptionsOfItsRecordingUnlessTheyAreGiven) {
  const test::TempFolder folder;
  const auto store = column();
  RunOptions options = shortRun();
  options.cell = 2;
  options.method = SolverMethod::force;
  options.stiffness_N_m = 150;
  options.record = folder / "a.rec";
  const Recorded live = record(*store, options);
  RunOptions again;
  again.device = "replay:" + options.record;
  const Recorded replayed = record(*store, again);
  EXPECT_EQ(replayed.rows, live.rows);
  EXPECT_EQ(replayed.summary.route, "random:3");
  EXPECT_EQ(replayed.summary.method, SolverMethod::force);
  ASSERT_EQ(replayed.summary.notes.size(), 1U);
  EXPECT_NE(replayed.summary.notes[0].find("--route random:3 --seconds 6 --method force --stiffness 150 --zoom 100"),
            std::string::npos)
      << replayed.summary.notes[0];
  // What is given counts, if only by its name, and is told.
  again.given = {"--method"};
  const Recorded other = record(*store, again);
  EXPECT_EQ(other.summary.method, SolverMethod::climb);
  ASSERT_GE(other.summary.notes.size(), 2U);
  EXPECT_NE(other.summary.notes[1].find("--method climb (recorded: force)"), std::string::npos);
  again.given.clear();
  again.zoom_um = 120;
  EXPECT_NE(record(*store, again).rows, live.rows);
  // A set without the cell.
  RunOptions elsewhere;
  elsewhere.device = again.device;
  EXPECT_THROW(run(*straightNeurite(), elsewhere), UsageError);
}

TEST(Run, ReplayRefusesTheRecordingOfASession) {
  const test::TempFolder folder;
  const auto store = column();
  {
    Session session(*store, {.in_memory = true, .record = folder / "s.rec"});
    session.advance(10);
    session.finish();
  }
  EXPECT_TRUE(isSessionRecording(folder / "s.rec"));
  RunOptions replay;
  replay.device = "replay:" + (folder / "s.rec");
  replay.in_memory = true;
  EXPECT_THROW(run(*store, replay), UsageError);
  std::filesystem::remove(folder / "s.rec.json");
  EXPECT_THROW(run(*store, replay), UsageError);
  RunOptions travel = shortRun();
  travel.record = folder / "r.rec";
  run(*store, travel);
  EXPECT_FALSE(isSessionRecording(folder / "r.rec"));
  EXPECT_THROW(Session(*store, {.device = "replay:" + travel.record, .in_memory = true}), UsageError);
}

// Replays the recording in `file` with `options`, without their time limit.
Recorded replay(const TileStore& store, RunOptions options, const std::string& file) {
  options.record.clear();
  options.device = "replay:" + file;
  options.realtime = false;
  options.latency_ms = 0;
  return record(store, options);
}

RunOptions shortTour() {
  RunOptions options;
  options.route = routeChoiceOf("tour:5");
  options.zoom_um = 100;
  options.seconds = 40;
  options.person.speed_m_s = 0.3;
  return options;
}

TEST(Run, ATourGoesOnUntilItsTimeIsOver) {
  const auto store = column();
  RunOptions options = shortTour();
  options.in_memory = true;
  const Recorded whole = record(*store, options);
  const RunSummary& s = whole.summary;
  EXPECT_EQ(s.outcome, RunOutcome::completed);
  EXPECT_EQ(s.ticks, 40000u);
  EXPECT_GT(s.legs, 3u);
  EXPECT_EQ(s.jumps, s.legs - 1);
  EXPECT_GT(s.legs_completed, 1u);
  EXPECT_LE(s.legs_completed, s.legs);
  EXPECT_EQ(s.jump_wait_ticks, 0u);
  EXPECT_GT(s.reached_um, 0);
  EXPECT_LE(s.reached_um, s.route_um);
  EXPECT_TRUE(s.notes.empty());
  // The same, bit for bit, whatever the budget, if the tiles of a tick fit it.
  options.in_memory = false;
  options.budget_bytes = 6 * Residency::floorBytes(*store);
  const Recorded floor = record(*store, options);
  EXPECT_GT(floor.summary.evictions, 0u);
  EXPECT_EQ(floor.summary.frontiers, 0u);
  ASSERT_EQ(floor.rows, whole.rows);
  EXPECT_EQ(floor.summary.jumps, s.jumps);
}

TEST(Run, ATourWaitsForTheTileThatItJumpsTo) {
  const auto store = column();
  RunOptions options = shortTour();
  options.latency_ms = 50;
  options.budget_bytes = Residency::floorBytes(*store);
  const Recorded late = record(*store, options);
  EXPECT_GT(late.summary.jumps, 2u);
  EXPECT_GT(late.summary.jump_wait_ticks, late.summary.jumps * 10);
  EXPECT_LE(late.summary.jump_wait_ticks, (late.summary.jumps + 1) * 60);
  EXPECT_TRUE(late.summary.notes.empty());
  EXPECT_EQ(record(*store, options).rows, late.rows);
}

// No tile that a tick asks for comes before the end of such a short run.
TEST(Run, ALateRunBeginsWhenItsTilesAreHere) {
  const auto store = column();
  std::uint64_t without_prefetch = 0;
  for (int tour = 1; tour <= 8; ++tour) {
    RunOptions options = shortTour();
    options.route = routeChoiceOf("tour:" + std::to_string(tour));
    options.latency_ms = 100;
    options.seconds = 0.1;
    EXPECT_EQ(record(*store, options).summary.frontiers, 0u) << tour;
    options.prefetch = PrefetchPolicy::none;
    without_prefetch += record(*store, options).summary.frontiers;
  }
  EXPECT_GT(without_prefetch, 0u) << "the hand leaves the first tile";
}

TEST(Run, AnEndlessLatencyDelaysNoRun) {
  const auto store = column();
  RunOptions options = shortTour();
  options.seconds = 0.1;
  for (const double latency_ms : {1e6, 1e15, 1e300}) {
    options.latency_ms = latency_ms;
    EXPECT_EQ(record(*store, options).summary.ticks, 100u);
  }
}

TEST(Run, ATourInRealTimeJumps) {
  const auto store = storeOf({line(8)}, 8);
  for (const bool in_memory : {false, true}) {
    RunOptions options = shortTour();
    options.realtime = true;
    options.in_memory = in_memory;
    options.zoom_um = 400;
    options.seconds = 1.5;
    const Recorded recorded = record(*store, options);
    EXPECT_EQ(recorded.summary.outcome, RunOutcome::completed);
    EXPECT_EQ(recorded.summary.ticks, 1500u);
    EXPECT_GE(recorded.summary.jumps, 1u);
    EXPECT_EQ(recorded.summary.legs, recorded.summary.jumps + 1);
  }
}

// Frontiers and jumps depend on the times at which tiles come; the recording stores them.
TEST(Run, ReplayOfLateTilesAndJumpsIsTheSameRunWhateverTimeItWasRecordedIn) {
  const test::TempFolder folder;
  const auto store = column();
  std::vector<std::pair<std::string, RunOptions>> cases;
  RunOptions late = shortRun();
  late.latency_ms = 40;
  late.prefetch = PrefetchPolicy::none;
  cases.emplace_back("late", late);
  late.device = "sim:loose";
  cases.emplace_back("late, loose hand", late);
  RunOptions tour = shortTour();
  cases.emplace_back("tour", tour);
  tour.latency_ms = 50;
  tour.budget_bytes = Residency::floorBytes(*store);
  cases.emplace_back("late tour", tour);
  tour.latency_ms = 0;
  tour.realtime = true;
  tour.seconds = 4;
  tour.person.speed_m_s = 1;
  cases.emplace_back("tour in real time", tour);
  RunOptions plain = shortRun();
  plain.realtime = true;
  plain.seconds = 2;
  cases.emplace_back("route in real time", plain);
  for (auto& [name, options] : cases) {
    SCOPED_TRACE(name);
    const std::string file = folder.file("r.rec");
    options.record = file;
    const Recorded live = record(*store, options);
    if (name.rfind("late", 0) == 0) {
      EXPECT_GT(live.summary.frontiers + live.summary.jump_wait_ticks, 0u);
    }
    const Recorded same = replay(*store, options, file);
    ASSERT_EQ(same.rows.size(), live.rows.size());
    EXPECT_EQ(same.rows, live.rows);
    EXPECT_EQ(same.summary.frontiers, live.summary.frontiers);
    EXPECT_EQ(same.summary.jumps, live.summary.jumps);
    EXPECT_EQ(same.summary.legs_completed, live.summary.legs_completed);
    EXPECT_EQ(same.summary.reached_um, live.summary.reached_um);
    if (!options.realtime) {
      EXPECT_TRUE(same.summary.notes.empty()) << same.summary.notes.front();
    }
    RunOptions in_memory = options;
    in_memory.in_memory = true;
    in_memory.budget_bytes.reset();
    EXPECT_EQ(replay(*store, in_memory, file).rows, live.rows);
    // Without a time limit, the run ends with the recording.
    options.seconds.reset();
    EXPECT_EQ(replay(*store, options, file).rows.size(), live.rows.size());
  }
}

TEST(Run, ATourIsNotReplayedInRealTime) {
  const test::TempFolder folder;
  const auto store = column();
  RunOptions options = shortTour();
  options.seconds = 1;
  options.record = folder.file("r.rec");
  record(*store, options);
  options.device = "replay:" + options.record;
  options.record.clear();
  options.realtime = true;
  EXPECT_THROW(record(*store, options), UsageError);
}

TEST(Run, ExceptionsOfTheTourPlannerPropagate) {
  const auto store = column();
  test::CountingStore failing(*store);
  RunOptions options = shortTour();
  options.solver = SolverParameters{};
  options.realtime = true;
  // A tile from which a later leg's cell is read, but not the first leg's. The planner is a few legs ahead.
  Tour tour(*store, 5);
  const std::vector<TileId> kept = store->loadCellDetail(tour.next().cell()).tiles;
  TileId lost = kNoTile;
  for (int leg = 0; leg < 3; ++leg)
    for (const TileId tile : store->loadCellDetail(tour.next().cell()).tiles)
      if (!std::binary_search(kept.begin(), kept.end(), tile)) lost = tile;
  ASSERT_NE(lost, kNoTile);
  failing.failLoads(lost);
  EXPECT_THROW(run(failing, options), CorruptTile);
}

}  // namespace
}  // namespace filiform
