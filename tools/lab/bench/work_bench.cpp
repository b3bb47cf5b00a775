// bench work: the work cap of a solver tick, against the distance of the proxy from its place without a cap, and
// against the force at the hand.
#include "index/build/memory_tiles.h"
#include "solver/graph/graph_view.h"
#include "solver/proxy/parameters.h"
#include "solver/travel/run.h"
#include "tools/lab/bench/dense_cells.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace filiform::tools {

namespace {

constexpr double kZooms[] = {300, 1000};
constexpr std::uint32_t kUnlimited = 16384;

struct WorkScene {
  explicit WorkScene(Cell cell) {
    CellList stream({std::move(cell)});
    store = buildTilesInMemory(stream);
    table = std::make_unique<TileTable>(store->tile_count());
    for (TileId id = 0; id < store->tile_count(); ++id) {
      tiles.push_back(store->load(id));
      table->add(*tiles.back());
    }
    view = std::make_unique<GraphView>(*table, store->leaves(), store->grid());
  }

  ProxyPlace placeOf(const TickRow& row) const {
    for (const auto& tile : tiles)
      if (const auto segment = tile->findSegment(row.segment)) {
        const Vector3d a_W = tile->position_W(tile->child(*segment)), b_W = tile->position_W(tile->parent(*segment));
        const double length2 = (b_W - a_W).squaredNorm();
        return view->placeAt(tile->id(), row.segment,
                             length2 > 0 ? std::clamp((row.p_W - a_W).dot(b_W - a_W) / length2, 0.0, 1.0) : 0.0);
      }
    throw std::logic_error("the proxy is on no tile");
  }

  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> tiles;
  std::unique_ptr<TileTable> table;
  std::unique_ptr<GraphView> view;
};

RunOptions routeOptions(const BenchOptions& options, const WorkScene& scene, SolverMethod method, std::uint32_t cap,
                        double zoom, std::uint64_t route) {
  RunOptions run_options;
  run_options.in_memory = true;
  run_options.method = method;
  run_options.zoom_um = zoom;
  run_options.cell = 0;
  run_options.route = "random:" + std::to_string(options.seed + route);
  run_options.seed = options.seed + route;
  run_options.solver = automaticParameters(*scene.store, 0);
  run_options.solver->max_visited = cap;
  if (options.quick) run_options.seconds = 1;
  return run_options;
}

struct Felt {
  double done = 0, runs = 0, force_Ns_um = 0, mean_N = 0, step_N = 0, capped = 0;
};

Felt feel(const BenchOptions& options, const std::vector<WorkScene>& scenes, SolverMethod method, std::uint32_t cap,
          double zoom, int routes) {
  Felt felt;
  double integral = 0, way = 0, time = 0, ticks = 0, capped = 0;
  for (const WorkScene& scene : scenes)
    for (int route = 0; route < routes; ++route) {
      const RunSummary s =
          run(*scene.store, routeOptions(options, scene, method, cap, zoom, static_cast<std::uint64_t>(route)));
      felt.done += s.outcome == RunOutcome::completed;
      felt.runs += 1;
      integral += s.force_integral_Ns, way += s.route_um, time += s.sim_s;
      ticks += static_cast<double>(s.ticks), capped += static_cast<double>(s.capped_ticks);
      felt.step_N = std::max(felt.step_N, s.max_force_step_N);
    }
  felt.force_Ns_um = integral / way;
  felt.mean_N = integral / time;
  felt.capped = capped / ticks;
  return felt;
}

// A faster loop feels smoother and takes more processor time. It also allows a higher stiffness (stability_bench.cpp).
void measureRate(const BenchOptions& options, const std::vector<WorkScene>& scenes, int routes, BenchReport& report) {
  BenchTable table{
      "rate",
      "Ticks a second, bounded climb, 300 um across 12 cm, medium hand, 200 N/m: routes completed, force a "
      "um of route (N s/um), largest force step from tick to tick (N), processor time a second of travel "
      "(per cent, the simulated hand included)",
      {"rate Hz", "done", "runs", "Ns_um", "step N", "cpu %"},
      {}};
  PlotSeries step{"largest force step (mN)", {}, {}}, cpu{"of a processor (%)", {}, {}};
  const RunOptions standard;
  for (const double rate_Hz : {125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0}) {
    if (options.quick && rate_Hz != 250 && rate_Hz != 1000 && rate_Hz != 4000) continue;
    options.progress(shown(rate_Hz) + " Hz");
    double done = 0, runs = 0, integral = 0, way = 0, most_N = 0, time_s = 0;
    const double from = threadTime_s();
    for (const WorkScene& scene : scenes)
      for (int route = 0; route < routes; ++route) {
        RunOptions run_options = routeOptions(options, scene, standard.method, SolverParameters{}.max_visited,
                                              kZooms[0], static_cast<std::uint64_t>(route));
        run_options.rate_Hz = rate_Hz;
        const RunSummary s = run(*scene.store, run_options);
        done += s.outcome == RunOutcome::completed, runs += 1;
        integral += s.force_integral_Ns, way += s.route_um, time_s += s.sim_s;
        most_N = std::max(most_N, s.max_force_step_N);
      }
    const double share = 100 * (threadTime_s() - from) / time_s;
    table.rows.push_back({rate_Hz, done, runs, integral / way, most_N, share});
    step.x.push_back(rate_Hz), step.y.push_back(1e3 * most_N);
    cpu.x.push_back(rate_Hz), cpu.y.push_back(share);
  }
  BenchCurve curve = tradeCurve("rate", "Haptic rate: force step that the hand gets, and processor time", "rate (Hz)",
                                "mN; per cent", {step, cpu}, true, true);
  addLine(curve, standard.rate_Hz, "default");
  const std::string knee = lineAtKnee(curve);
  const auto at = static_cast<std::size_t>(std::find(step.x.begin(), step.x.end(), standard.rate_Hz) - step.x.begin());
  curve.finding = "From " + shown(step.x.front()) + " to " + shown(step.x.back()) + " Hz the largest step falls from " +
                  shown(step.y.front()) + " to " + shown(step.y.back()) + " mN and a processor is busy for " +
                  shown(cpu.y.front()) + " to " + shown(cpu.y.back()) + " % (" + knee + "). At the default of " +
                  shown(standard.rate_Hz) + " Hz: " + shown(step.y.at(at)) + " mN, " + shown(cpu.y.at(at)) +
                  " %. It stays: devices are read a thousand times a second. Exact would be infinitely fast.";
  report.curves.push_back(std::move(curve));
  report.tables.push_back(std::move(table));
}

// The same probes for all caps: those of hands that travelled without a cap.
struct Probes {
  const WorkScene* scene;
  double zoom_um;
  ProxyPlace start;
  std::vector<Vector3d> h_W;
};

BenchReport runWork(const BenchOptions& options) {
  BenchReport report;
  options.progress("cells");
  std::vector<WorkScene> scenes;
  for (Cell& cell : morphologyLibrary(options.corpus, options.quick ? 1 : 4, options.seed))
    scenes.emplace_back(std::move(cell));
  const int routes = options.quick ? 1 : 3;
  const SolverMethod standard = RunOptions{}.method;
  const std::uint32_t standard_cap = SolverParameters{}.max_visited;

  std::vector<Probes> all;
  for (const double zoom : kZooms)
    for (const WorkScene& scene : scenes) {
      options.progress("a hand without a limit, zoom " + shown(zoom));
      Probes probes{&scene, zoom, {}, {}};
      const auto solver_options = routeOptions(options, scene, standard, kUnlimited, zoom, 0);
      run(*scene.store, solver_options, [&](const TickRow& row) {
        if (probes.h_W.empty()) probes.start = scene.placeOf(row);
        if (probes.h_W.size() < 60'000) probes.h_W.push_back(row.h_W);
      });
      all.push_back(std::move(probes));
    }

  BenchTable table{
      "cap",
      "Segments that a tick of bounded climb may test: how far the proxy lies from where it would be without "
      "a limit on the same probes (um across 12 cm: 300 and 1000), share of ticks cut short, us of CPU a "
      "tick; then with the hand in the loop: routes completed, force, its largest step",
      {"cap", "error mean um", "error p99.9 um", "error most um", "cut short", "visited most", "us mean", "us p99.9",
       "done_1000", "runs", "Ns_um_1000", "mean N", "step N"},
      {}};
  PlotSeries error{"mean error of the proxy", {}, {}};
  PlotSeries force{"force, N s/mm at 1000 um", {}, {}};
  std::vector<std::vector<Vector3d>> truth(all.size());
  double at_default_us = 0, at_default_error = 0;
  std::vector<std::uint32_t> caps{kUnlimited, 1024, 512, 256, 128, 64, 32, 16, 8};
  if (options.quick) caps = {kUnlimited, 256, 16};
  for (const std::uint32_t cap : caps) {
    options.progress("at most " + std::to_string(cap) + " segments a tick");
    std::vector<double> errors, us;
    double most_visited = 0, cut = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Probes& probes = all[i];
      SolverParameters parameters = automaticParameters(*probes.scene->store, 0);
      parameters.max_visited = cap;
      const auto solver = makeProxySolver(standard, parameters);
      solver->setPlace(probes.start);
      SolverStep step;
      for (std::size_t tick = 0; tick < probes.h_W.size(); ++tick) {
        const ProbeState probe{probes.h_W[tick], 1e-3, probes.zoom_um / 0.12};
        const double from = threadTime_s();
        solver->advance(*probes.scene->view, probe, step);
        us.push_back(1e6 * (threadTime_s() - from));
        if (cap == kUnlimited)
          truth[i].push_back(solver->place().p_W);
        else
          errors.push_back((solver->place().p_W - truth[i][tick]).norm());
        most_visited = std::max(most_visited, static_cast<double>(step.visited));
        cut += step.capped;
      }
    }
    double sum = 0, mean_us = 0;
    for (const double e : errors) sum += e;
    for (const double t : us) mean_us += t / static_cast<double>(us.size());
    const double mean = errors.empty() ? 0 : sum / static_cast<double>(errors.size());
    const Felt felt = feel(options, scenes, standard, cap, 1000, routes);
    table.rows.push_back({std::int64_t{cap}, mean, errors.empty() ? 0.0 : percentile(errors, 0.999),
                          errors.empty() ? 0.0 : percentile(errors, 1), cut / static_cast<double>(us.size()),
                          static_cast<std::int64_t>(most_visited), mean_us, percentile(us, 0.999), felt.done, felt.runs,
                          felt.force_Ns_um, felt.mean_N, felt.step_N});
    report.bounds.push_back({"work cap " + std::to_string(cap), "tested segments at most max_visited (bounded_climb.h)",
                             static_cast<double>(cap), most_visited, "segments"});
    error.x.push_back(cap), error.y.push_back(mean);
    force.x.push_back(cap), force.y.push_back(1e3 * felt.force_Ns_um);
    if (cap == standard_cap) at_default_us = percentile(us, 0.999), at_default_error = mean;
  }
  for (PlotSeries* series : {&error, &force}) {
    std::reverse(series->x.begin(), series->x.end());
    std::reverse(series->y.begin(), series->y.end());
  }
  BenchCurve curve = tradeCurve("cap", "Work cap: proxy error and force", "segments a tick at most",
                                "error (um), force (N s/mm)", {error, force}, true, false);
  addLine(curve, kUnlimited, "exact");
  addLine(curve, standard_cap, "default");
  const std::string knee = lineAtKnee(curve);
  curve.finding = "At the default of " + std::to_string(standard_cap) + " the proxy is off by " +
                  shown(at_default_error) + " um on average and a tick takes " + shown(at_default_us) +
                  " us at the 99.9th percentile (" + knee + " for the error).";
  report.curves.push_back(std::move(curve));
  report.tables.push_back(std::move(table));

  BenchTable methods{
      "methods",
      "The methods at the default cap: routes completed, force a um of route (N s/um), mean force, largest "
      "step from tick to tick (N); zoom in um across 12 cm",
      {"method", "done_300", "Ns_um_300", "N_300", "step_300", "done_1000", "Ns_um_1000", "N_1000", "step_1000",
       "runs"},
      {}};
  for (const SolverMethod method : kSolverMethods) {
    std::vector<BenchValue> row{std::string(toString(method))};
    double runs = 0;
    for (const double zoom : kZooms) {
      options.progress(std::string(toString(method)) + ", zoom " + shown(zoom));
      const Felt felt = feel(options, scenes, method, standard_cap, zoom, routes);
      row.insert(row.end(), {felt.done, felt.force_Ns_um, felt.mean_N, felt.step_N});
      runs = felt.runs;
    }
    row.emplace_back(runs);
    methods.rows.push_back(std::move(row));
  }
  report.tables.push_back(std::move(methods));
  measureRate(options, scenes, routes, report);
  report.notes.push_back(std::to_string(scenes.size()) + " cells, " + std::to_string(routes) +
                         " random routes each, medium hand, 200 N/m, 1 kHz. " +
                         (options.corpus.empty() ? "Synthetic; --corpus DIR takes real ones." : "Real cells."));
  report.notes.push_back("The proxy's error is against the same solver with " + std::to_string(kUnlimited) +
                         " segments a tick, each fed the same probes; it holds what a lost branch carries on to later "
                         "ticks.");
  return report;
}

}  // namespace

void addWorkWorkloads(std::vector<Workload>& all) {
  all.push_back({"work", "the solver's work cap and method against proxy error and force", runWork});
}

}  // namespace filiform::tools
