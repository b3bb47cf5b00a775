// The figures of "Forces on routes" in solver/RESULTS.md, and their bounds. Prints the table as it stands there.
#include "index/ingest/memory_tiles.h"
#include "solver/travel/run/run.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

constexpr int kRoutes = 8;

struct Figures {
  int completed = 0;
  double ticks = 0, force_sum_N = 0, integral_Ns = 0, route_um = 0;
  double max_N = 0, rise_N = 0, step_N = 0;
};

Figures measure(const TileStore& store, SolverMethod method, double zoom_um) {
  Figures figures;
  for (int route = 0; route < kRoutes; ++route) {
    RunOptions options;
    options.cell = static_cast<std::uint32_t>(route) % store.cell_count();
    options.route = routeChoiceOf("random:" + std::to_string(route));
    options.method = method;
    options.zoom_um = zoom_um;
    options.in_memory = true;
    options.seconds = 15;
    double last_N = 0;
    Vector3d last_W = Vector3d::Zero();
    const RunSummary summary = run(store, options, [&](const TickRow& row) {
      // The increase without the part that the hand's own step causes.
      const double stretched_N = 200 * (row.h_W - last_W).norm() / (zoom_um / 0.12);
      figures.rise_N = std::max(figures.rise_N, row.force_N.norm() - last_N - (row.tick > 0 ? stretched_N : 0.0));
      last_W = row.h_W;
      last_N = row.force_N.norm();
    });
    figures.completed += summary.outcome == RunOutcome::completed;
    figures.ticks += static_cast<double>(summary.ticks);
    figures.integral_Ns += summary.force_integral_Ns;
    figures.force_sum_N += summary.mean_force_N * static_cast<double>(summary.ticks);
    figures.route_um += summary.route_um;
    figures.max_N = std::max(figures.max_N, summary.max_force_N);
    figures.step_N = std::max(figures.step_N, summary.max_force_step_N);
  }
  return figures;
}

TEST(Forces, FiguresKeepTheirBounds) {
  CellList stream(test::randomColumn(1, 4, 1500, 200));
  const std::unique_ptr<TileStore> store = buildTilesInMemory(stream);
  std::printf(
      "| method | zoom, um | completed in 15 s | mean, N | largest, N | largest rise in a tick, N | largest step, N | "
      "N s/um |\n");
  std::printf("|---|---|---|---|---|---|---|---|\n");
  for (const SolverMethod method : kSolverMethods) {
    for (const double zoom_um : {100.0, 300.0, 1000.0}) {
      const Figures f = measure(*store, method, zoom_um);
      std::printf("| %s | %.0f | %d of %d | %.3f | %.2f | %.3f | %.2f | %.4f |\n", toString(method), zoom_um,
                  f.completed, kRoutes, f.force_sum_N / f.ticks, f.max_N, f.rise_N, f.step_N,
                  f.integral_Ns / f.route_um);
      EXPECT_LE(f.max_N, 8 * (1 + 1e-12));
      EXPECT_LE(f.rise_N, (100 + 8 / 0.5) * 1e-3 * (1 + 1e-9));
      EXPECT_LE(f.step_N, f.max_N + (100 + 8 / 0.5) * 1e-3);
      EXPECT_GT(f.max_N, 0);
    }
  }
}

}  // namespace
}  // namespace filiform
