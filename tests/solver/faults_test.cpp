// The hand is safe whatever happens to the disk: tiles are late, missing, damaged, removed while open, or never come.
// Commanded forces are finite, within the limit, and grow no faster than force_law.h says.
#include "device/recording/internal/recording_format.h"
#include "index/file/faulty_source.h"
#include "index/ingest/ingest.h"
#include "index/ingest/memory_tiles.h"
#include "index/set/tile_set.h"
#include "index/streaming/residency.h"
#include "solver/force/force_law.h"
#include "solver/travel/run/run.h"
#include "tests/support/campaign.h"
#include "tests/support/numbers.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::kDt_s;

namespace fs = std::filesystem;

constexpr double kStiffness_N_m = 200;

std::vector<Cell> smallColumn() { return test::randomColumn(7, 4, 1200, 150); }

// The largest increase of the force in a tick in which the hand moved by `step_m`.
double mostGrowth_N(double step_m, double dt_s = kDt_s) {
  const ForceLawOptions options;
  return (options.max_slew_N_s + options.max_force_N / options.ramp_s) * dt_s +
         kStiffness_N_m * std::min(step_m, options.free_speed_m_s * dt_s) + 1e-9;
}

TEST(Faults, HoweverLateTheTilesTheForceKeepsItsLimits) {
  CellList stream(smallColumn());
  const auto store = buildTilesInMemory(stream, {.capacity = 64});
  std::uint64_t ticks = 0, frontiers = 0;
  const std::vector<double> latencies = test::wholeCampaign()
                                            ? std::vector<double>{0, 1, 2, 5, 10, 20, 50, 100, 200, 350, 500}
                                            : std::vector<double>{0, 20, 500};
  for (const double latency_ms : latencies) {
    for (const auto prefetch : {PrefetchPolicy::none, PrefetchPolicy::structure}) {
      SCOPED_TRACE("latency " + std::to_string(latency_ms));
      RunOptions options;
      options.route = routeChoiceOf("random:3");
      options.zoom_um = 100;
      options.seconds = test::wholeCampaign() ? 30 : 4;
      options.latency_ms = latency_ms;
      options.prefetch = prefetch;
      options.budget_bytes = Residency::floorBytes(*store) * 3 / 2;
      double last_N = 0;
      Vector3d last_W = Vector3d::Zero();
      std::uint64_t wrong = 0;
      const RunSummary summary = run(*store, options, [&](const TickRow& row) {
        const double force_N = row.force_N.norm();
        const double step_m = row.tick == 0 ? 0 : (row.h_W - last_W).norm() * 0.12 / options.zoom_um;
        wrong += !row.force_N.allFinite() || force_N > ForceLawOptions{}.max_force_N * (1 + 1e-12);
        wrong += force_N > last_N + mostGrowth_N(step_m);
        last_N = force_N;
        last_W = row.h_W;
      });
      EXPECT_EQ(wrong, 0u);
      ticks += summary.ticks;
      frontiers += summary.frontiers;
    }
  }
  EXPECT_GT(frontiers, 0u);
  test::tell(std::to_string(ticks) + " ticks with tiles 0 to 500 ms late, " + std::to_string(frontiers) +
             " of them at a frontier: every force finite, limited, slew-limited");
}

class FaultsUnderfoot : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Disk, FaultsUnderfoot, testing::Values("fails", "truncated", "silent", "slow"),
                         [](const auto& of) { return std::string(of.param); });

TEST_P(FaultsUnderfoot, TheDeviceIsSentSafeForces) {
  const std::string kind = GetParam();
  const test::TempFolder folder;
  CellList stream(smallColumn());
  ingest(stream, folder / "a.fil", {.capacity = 64});
  std::atomic<bool> released{false};
  FaultPlan plan;
  if (kind == "fails") plan.fail_probability = 1;
  if (kind == "silent" || kind == "slow") plan = {.delay = FaultPlan::Delay::uniform, .delay_s = 0.25};
  if (kind == "silent")
    plan.wait = [&](double) {
      while (!released) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
  auto source = std::make_unique<FaultySource>(openFolder(folder / "a.fil"), plan);
  FaultySource& faults = *source;
  const auto set = TileSet::open(std::move(source));

  RunOptions options;
  options.route = routeChoiceOf("random:3");
  options.zoom_um = 500;
  options.realtime = true;
  options.seconds = test::wholeCampaign() ? 20 : 2;
  options.prefetch = PrefetchPolicy::none;
  options.budget_bytes = Residency::floorBytes(*set) * 3 / 2;
  options.record = folder / "r.rec";
  // A run calls `ending` before it waits for its threads.
  if (kind == "silent") options.ending = [&](const RunSummary&) { released = true; };
  const auto on_tick = [&](const TickRow& row) {
    if (row.tick == 100) {
      faults.arm();
      if (kind == "truncated")
        for (const auto& entry : fs::recursive_directory_iterator(folder / "a.fil"))
          if (entry.path().extension() == ".pack") fs::resize_file(entry.path(), 16);
    }
  };
  const RunSummary summary = run(*set, options, on_tick);
  EXPECT_GT(summary.frontiers, 0u);
  EXPECT_EQ(kind == "fails" || kind == "truncated", !summary.failures.empty());

  const std::string bytes = test::readBytes(options.record);
  internal::RecordingHeader header;
  std::size_t at = internal::readHeader("r", bytes, header);
  double last_N = 0;
  DeviceState before, earlier;
  std::uint64_t sent = 0, wrong = 0;
  internal::RecordedExchange exchange;
  for (; bytes.size() - at >= internal::kExchangeBytes; at += internal::kExchangeBytes, ++sent) {
    if (!internal::readExchange(std::string_view(bytes).substr(at), sent, exchange, false)) break;
    const double force_N = exchange.wrench.force_N.norm();
    wrong += !exchange.wrench.force_N.allFinite() || force_N > ForceLawOptions{}.max_force_N * (1 + 1e-12);
    // This force belongs to the state before it.
    wrong +=
        sent > 1 && force_N > last_N + mostGrowth_N((before.p_D - earlier.p_D).norm(), before.time_s - earlier.time_s);
    last_N = force_N;
    earlier = before;
    before = exchange.state;
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(sent, 500u);
}

}  // namespace
}  // namespace filiform
