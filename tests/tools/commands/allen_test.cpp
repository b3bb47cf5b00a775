// The whole path on real reconstructions: the Allen Cell Types folder of the corpus, from SWC to a hand on a neurite.
#include "index/formats/swc.h"
#include "index/geometry/closest_point.h"
#include "index/ingest/ingest.h"
#include "index/input/input.h"
#include "index/query/cell_graph.h"
#include "index/query/nearest.h"
#include "index/verify/verify.h"
#include "solver/travel/run/run.h"
#include "tests/support/corpus.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <bit>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

namespace filiform {
namespace {

class Allen : public ::testing::Test {
 protected:
  void SetUp() override {
    FILIFORM_NEEDS_CORPUS();
    source_ = (*test::corpusFolder() / "morphologies" / "allen-celltypes").string();
    Input input({source_});
    ingest(input, folder_.file("allen.fil"));
    set_ = TileSet::open(folder_.file("allen.fil"));
  }
  std::vector<TickRow> travel(SolverMethod method, std::optional<std::uint64_t> budget, double latency_ms,
                              RunSummary& summary) {
    RunOptions options;
    options.route = routeChoiceOf("longest");
    options.zoom_um = 100;
    options.method = method;
    options.budget_bytes = budget;
    options.latency_ms = latency_ms;
    std::vector<TickRow> rows;
    summary = run(*set_, options, [&](const TickRow& row) { rows.push_back(row); });
    return rows;
  }

  test::TempFolder folder_;
  std::string source_;
  std::unique_ptr<TileSet> set_;
};

// Compares rows as in the CSV: shortest decimals read back to the same double, so equal numbers are equal text.
bool sameRow(const TickRow& a, const TickRow& b) {
  return a.tick == b.tick && a.time_s == b.time_s && a.h_W == b.h_W && a.p_W == b.p_W && a.segment == b.segment &&
         a.force_N == b.force_N && a.visited == b.visited && a.frontier == b.frontier;
}

TEST_F(Allen, HoldsWhatTheFolderHolds) {
  EXPECT_EQ(set_->counts().cells, 100u);
  EXPECT_EQ(set_->counts().samples, 403661u);
  EXPECT_EQ(set_->counts().segments, 402639u);
  const VerifyReport report = verify(folder_.file("allen.fil"), {.deep = true});
  EXPECT_TRUE(report.sound()) << report.problems.front();
}

TEST_F(Allen, EveryCellComesBackAsItsSource) {
  Input input({source_});
  std::uint32_t id = 0;
  for (Cell cell; input.next(cell); ++id) {
    if (test::kSanitized && id % 8 != 0) continue;
    SCOPED_TRACE(cell.source);
    std::stringstream text;
    writeSwc(text, readCell(*set_, id, true));
    Cell back;
    const InputReport report = readSwc(text.str(), "export", {}, back);
    ASSERT_NE(report.severity, Severity::kRefuse);
    ASSERT_EQ(back.sample_ids, cell.sample_ids);
    ASSERT_EQ(back.parents, cell.parents);
    ASSERT_EQ(back.types, cell.types);
    const Grid grid = set_->grid();
    for (std::size_t i = 0; i < cell.samples(); ++i) {
      ASSERT_EQ(std::bit_cast<std::uint32_t>(back.radii_um[i]), std::bit_cast<std::uint32_t>(cell.radii_um[i])) << i;
      ASSERT_EQ(grid.snap(back.positions_um[i]), grid.snap(cell.positions_um[i])) << i;
    }
  }
  EXPECT_EQ(id, 100u);
}

TEST_F(Allen, NearestEqualsBruteForce) {
  std::vector<std::shared_ptr<const Tile>> tiles;
  for (TileId id = 0; id < set_->tile_count(); ++id) tiles.push_back(set_->load(id));
  const Nearest nearest(*set_);
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 60; ++i) {
    const Tile& some = *tiles[random() % tiles.size()];
    const double reach_um = i % 3 == 0 ? 1 : i % 3 == 1 ? 200 : 1e5;  // near, within the tissue, far
    const Vector3d h_W = some.position_W(static_cast<std::uint32_t>(random() % some.node_count())) +
                         reach_um * Vector3d(unit(random), unit(random), unit(random));
    double best2 = std::numeric_limits<double>::infinity();
    SegmentId best{};
    for (const auto& tile : tiles)
      for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
        const double d2 =
            closestPoint(tile->position_W(tile->child(s)), tile->position_W(tile->parent(s)), h_W).squared_distance;
        if (d2 < best2 || (d2 == best2 && tile->segmentId(s) < best)) best2 = d2, best = tile->segmentId(s);
      }
    const auto found = nearest.find(h_W);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].segment, best) << h_W.transpose();
    EXPECT_DOUBLE_EQ(found[0].distance_um, std::sqrt(best2));
    EXPECT_TRUE(found[0].exact);
  }
}

TEST_F(Allen, ASmallBudgetChangesNothingThatTheHandFeels) {
  for (const SolverMethod method : {SolverMethod::force, SolverMethod::basic}) {
    RunSummary all, tight;
    const std::vector<TickRow> free_rows = travel(method, std::nullopt, 0, all);
    const std::vector<TickRow> rows = travel(method, set_->counts().decoded_bytes / 20, 0, tight);
    EXPECT_GT(tight.evictions, 0u);
    EXPECT_EQ(tight.frontiers, 0u);
    EXPECT_LE(tight.peak_bytes, *tight.budget_bytes);
    EXPECT_EQ(tight.outcome, all.outcome);
    EXPECT_EQ(tight.outcome == RunOutcome::completed, method == SolverMethod::force);
    ASSERT_EQ(rows.size(), free_rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) ASSERT_TRUE(sameRow(rows[i], free_rows[i])) << "tick " << i;
  }
}

TEST_F(Allen, WithLatencyTheFirstDifferenceIsACountedFrontier) {
  RunSummary all, late;
  const std::vector<TickRow> free_rows = travel(SolverMethod::force, std::nullopt, 0, all);
  const std::vector<TickRow> rows = travel(SolverMethod::force, set_->counts().decoded_bytes / 20, 20, late);
  std::uint64_t frontiers = 0;
  for (const TickRow& row : rows) frontiers += row.frontier;
  EXPECT_EQ(frontiers, late.frontiers);
  for (std::size_t i = 0; i < std::min(rows.size(), free_rows.size()); ++i) {
    if (rows[i].frontier) return;  // after this tick the runs may differ
    ASSERT_TRUE(sameRow(rows[i], free_rows[i])) << "tick " << i;
  }
  EXPECT_EQ(rows.size(), free_rows.size());
}

}  // namespace
}  // namespace filiform
