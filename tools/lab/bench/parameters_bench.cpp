// bench parameters: how much the automatic parameters of the paper's solver matter. Runs real cells with r_min, r_max
// and G changed one by one, with the paper's choice (shortest and longest segment of the data), and with none.
#include "index/build/memory_tiles.h"
#include "solver/proxy/parameters.h"
#include "solver/travel/run.h"
#include "tools/lab/bench/dense_cells.h"
#include "tools/lab/bench/workloads.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

namespace filiform::tools {

namespace {

struct NamedStore {
  std::string name;
  std::unique_ptr<TileStore> store;
};

std::vector<NamedStore> storesOf(std::vector<Cell> cells) {
  std::vector<NamedStore> stores;
  for (Cell& cell : cells) {
    CellList stream({std::move(cell)});
    auto store = buildTilesInMemory(stream);
    stores.push_back({store->cell(0).name, std::move(store)});
  }
  return stores;
}

SolverParameters papersOwn(const TileStore& store) {
  double least = INFINITY, most = 0;
  for (TileId id = 0; id < store.tile_count(); ++id) {
    const auto tile = store.load(id);
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      const double length = (tile->position_W(tile->child(s)) - tile->position_W(tile->parent(s))).norm();
      if (length > 0) least = std::min(least, length);
      most = std::max(most, length);
    }
  }
  SolverParameters parameters;
  parameters.r_min_um = std::isfinite(least) ? least : 0;
  parameters.r_max_um = most;
  return parameters;
}

BenchReport runParameters(const BenchOptions& options) {
  BenchReport report;
  const std::vector<NamedStore> cells = storesOf(morphologyLibrary(options.corpus,
                                                                   options.quick            ? 1
                                                                   : options.corpus.empty() ? 4
                                                                                            : 8,
                                                                   options.seed));
  if (options.corpus.empty()) report.notes.push_back("no corpus of real cells was given (--corpus): synthetic ones");
  struct Variant {
    std::string name;
    std::function<void(SolverParameters&, const TileStore&)> change;
  };
  const std::vector<Variant> variants{
      {"automatic", [](SolverParameters&, const TileStore&) {}},
      {"r_min / 4", [](SolverParameters& p, const TileStore&) { p.r_min_um /= 4; }},
      {"r_min x 4", [](SolverParameters& p, const TileStore&) { p.r_min_um *= 4; }},
      {"r_max / 4", [](SolverParameters& p, const TileStore&) { p.r_max_um /= 4; }},
      {"r_max x 4", [](SolverParameters& p, const TileStore&) { p.r_max_um *= 4; }},
      {"G / 4", [](SolverParameters& p, const TileStore&) { p.gain /= 4; }},
      {"G x 4", [](SolverParameters& p, const TileStore&) { p.gain *= 4; }},
      {"all x 4",
       [](SolverParameters& p, const TileStore&) {
         p.r_min_um *= 4;
         p.r_max_um *= 4;
         p.gain *= 4;
       }},
      {"shortest and longest (the paper)", [](SolverParameters& p, const TileStore& s) { p = papersOwn(s); }},
      {"none: r = 0", [](SolverParameters& p, const TileStore&) { p.gain = p.r_min_um = p.r_max_um = 0; }}};
  BenchTable table{
      "sensitivity",
      "Force-based solver, medium hand, K 200 N/m, random routes: routes completed, force integral a um of "
      "route (N s/um) and mean force (N), at each zoom (um across 12 cm)",
      {"parameters", "done_100", "Ns_um_100", "N_100", "done_300", "Ns_um_300", "N_300", "done_1000", "Ns_um_1000",
       "N_1000", "routes"},
      {}};
  const std::vector<double> zooms{100, 300, 1000};
  const int routes = options.quick ? 1 : options.long_run ? 6 : 2;
  std::int64_t base_done = 0;
  double largest_change = 0;
  for (const Variant& variant : variants) {
    std::vector<BenchValue> row{variant.name};
    std::int64_t done_in_all = 0, runs = 0;
    for (const double zoom : zooms) {
      std::int64_t done = 0;
      runs = 0;
      double integral = 0, length = 0, time = 0;
      for (const NamedStore& cell : cells) {
        options.progress(variant.name + ", " + cell.name);
        RunOptions run_options;
        run_options.in_memory = true;
        run_options.method = SolverMethod::force;
        run_options.zoom_um = zoom;
        run_options.solver = automaticParameters(*cell.store, 0);
        run_options.cell = 0;
        if (options.quick) run_options.seconds = 1;
        variant.change(*run_options.solver, *cell.store);
        for (int route = 0; route < routes; ++route) {
          run_options.route = "random:" + std::to_string(options.seed + static_cast<std::uint64_t>(route));
          run_options.seed = options.seed + static_cast<std::uint64_t>(route);
          const RunSummary s = run(*cell.store, run_options);
          done += s.outcome == RunOutcome::completed;
          integral += s.force_integral_Ns;
          length += s.route_um;
          time += s.sim_s;
          ++runs;
        }
      }
      row.emplace_back(done);
      row.emplace_back(integral / length);
      row.emplace_back(integral / time);
      done_in_all += done;
    }
    row.emplace_back(runs);
    table.rows.push_back(std::move(row));
    if (variant.name == "automatic") base_done = done_in_all;
    if (variant.name != "none: r = 0" && base_done > 0)
      largest_change = std::max(
          largest_change, std::abs(static_cast<double>(done_in_all - base_done)) / static_cast<double>(base_done));
  }
  report.tables.push_back(std::move(table));
  BenchTable used{
      "cells", "The cells, and their automatic parameters (um)", {"cell", "segments", "r_min", "r_max"}, {}};
  for (const NamedStore& cell : cells) {
    const SolverParameters p = automaticParameters(*cell.store, 0);
    used.rows.push_back({cell.name, static_cast<std::int64_t>(cell.store->cell(0).segments), p.r_min_um, p.r_max_um});
  }
  report.tables.push_back(std::move(used));
  report.goals.push_back({"change in routes completed by parameters 4 times as large or small", "-", "<= 0.05",
                          largest_change, true, largest_change <= 0.05});
  return report;
}

}  // namespace

void addParametersWorkloads(std::vector<Workload>& all) {
  all.push_back({"parameters", "how much r_min, r_max and G of the force-based solver matter", runParameters});
}

}  // namespace filiform::tools
