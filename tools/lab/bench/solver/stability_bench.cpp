// bench stability: where rendering vibrates, without and with the passivity controller.
//
// A hold: the target of a hand on a neurite steps away and then rests. The hand should come to rest. A hold
// *oscillates* if after 3 s the hand still swings by more than 20 um in each of four quarters of a second, without
// dying away. A swing is the hand's motion beyond its way from the window's begin to its end, so that creep does not
// count.
#include "device/simulated/simulated_hand.h"
#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "solver/graph/graph_view.h"
#include "solver/proxy/parameters.h"
#include "solver/travel/run/run.h"
#include "solver/workspace/navigation.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"
#include "tools/lab/reference/energy_sweep.h"
#include "tools/lab/shared/parallel.h"
#include "tools/pictures/canvas.h"
#include "tools/pictures/png.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <random>
#include <sstream>
#include <thread>

namespace filiform::tools {

namespace {

constexpr double kSettle_s = 3.0, kWindow_s = 0.25;
constexpr int kWindows = 4;
// A hold oscillates if all windows swing above kMoves_m, and the last above kDies of the first.
constexpr double kMoves_m = 20e-6, kDies = 0.8;
const char* const kHands[] = {"loose", "medium", "firm"};

std::string shortNumber(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

// All tiles of a small store. Any number of threads may read.
struct StabilityScene {
  explicit StabilityScene(std::unique_ptr<TileStore> opened) : store(std::move(opened)), table(store->tile_count()) {
    for (TileId id = 0; id < store->tile_count(); ++id) {
      tiles.push_back(store->load(id));
      table.add(*tiles.back());
    }
  }
  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> tiles;
  TileTable table;
};

std::unique_ptr<TileStore> syntheticStore(std::uint32_t cells, std::uint64_t seed) {
  SyntheticOptions options;
  options.cells = cells;
  options.seed = seed;
  SyntheticCells stream(options);
  return buildTilesInMemory(stream);
}

struct Hold {  // one combination, and its pull
  std::string hand = "medium";
  double rate_Hz = 1000;
  int delay = 1;
  double device_damping_Ns_m = 0.5;
  double stiffness_N_m = 200;
  bool controller = false;
  std::uint64_t seed = 1;  // of place and pull
};

struct HoldOutcome {
  bool oscillates = false;
  double swing_m = 0;  // of the hand in the last window
  double force_N = 0;  // the largest in the last window
  double least_J = 0;  // observed energy
  double bound_J = 0;  // the controller's promise, > 0: least_J >= -bound_J
  double given_W = 0;  // mean power given to the hand over the windows, by the force that acted
};

HoldOutcome hold(const StabilityScene& scene, const Hold& what, SolverMethod method,
                 const SolverParameters& parameters) {
  std::mt19937_64 random(what.seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const GraphView graph(scene.table, scene.store->leaves(), scene.store->grid());
  const Tile& tile = *scene.tiles[random() % scene.tiles.size()];
  const auto segment = static_cast<std::uint32_t>(random() % tile.segment_count());

  SimulatedHandOptions hand_options;
  hand_options.hand = handParameters(what.hand);
  hand_options.period_s = 1 / what.rate_Hz;
  hand_options.delay_samples = what.delay;
  hand_options.device_damping_Ns_m = what.device_damping_Ns_m;
  SimulatedHand hand(hand_options);
  hand.open();

  NavigationOptions options;
  options.force.stiffness_N_m = what.stiffness_N_m;
  options.force.ramp_s = 0;
  options.force.passivity.on = what.controller;
  options.force.passivity.delay_samples = what.delay;
  options.buttons.fill(ButtonAction::none);
  Navigation navigation(graph, makeProxySolver(method, parameters), options);
  NavigationCommand jump;
  jump.kind = NavigationCommand::Kind::jump;
  jump.place = graph.placeAt(tile.id(), tile.segmentId(segment), unit());
  navigation.apply(jump, Eigen::Vector3d::Zero());

  Eigen::Vector3d pull(2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1);
  pull *= (0.002 + 0.013 * unit()) / std::max(0.1, pull.norm());
  hand.setTarget(pull);

  const double dt_s = 1 / what.rate_Hz;
  const auto settle = static_cast<std::uint64_t>(kSettle_s * what.rate_Hz);
  const auto window = static_cast<std::uint64_t>(kWindow_s * what.rate_Hz);
  HoldOutcome held;
  std::array<double, kWindows> swing_m{};
  Wrench wrench;
  Eigen::Vector3d last_D = Eigen::Vector3d::Zero();
  double longest_m = 0, given_J = 0;
  std::vector<Eigen::Vector3d> acting(static_cast<std::size_t>(what.delay) + 1, Eigen::Vector3d::Zero());
  std::uint64_t tick = 0;
  for (int w = -1; w < kWindows; ++w) {
    Eigen::Vector3d lo = Eigen::Vector3d::Constant(1e9), hi = -lo;
    const Eigen::Vector3d begin_D = last_D;
    for (std::uint64_t i = 0; i < (w < 0 ? settle : window); ++i, ++tick) {
      acting[tick % acting.size()] = wrench.force_N;
      const DeviceState state = hand.exchange(wrench);
      longest_m = std::max(longest_m, (state.p_D - last_D).norm());
      if (w >= 0) given_J += acting[(tick + 1) % acting.size()].dot(state.p_D - last_D);
      last_D = state.p_D;
      wrench = navigation.tick(state, dt_s).wrench;
      lo = lo.cwiseMin(state.p_D);
      hi = hi.cwiseMax(state.p_D);
      if (w == kWindows - 1) held.force_N = std::max(held.force_N, wrench.force_N.norm());
    }
    if (w >= 0) swing_m[static_cast<std::size_t>(w)] = (hi - lo - (last_D - begin_D).cwiseAbs()).cwiseMax(0).norm();
  }
  held.swing_m = swing_m.back();
  held.oscillates = *std::min_element(swing_m.begin(), swing_m.end()) > kMoves_m && swing_m.back() > kDies * swing_m[0];
  held.given_W = given_J / (kWindows * kWindow_s);
  held.least_J = navigation.force_law().energy().least;
  // The workspace may drift at 0.1 m/s while the hand moves.
  held.bound_J = options.force.passivity.energy_J +
                 (what.delay + 1) * options.force.max_force_N * (longest_m + options.workspace.drift_speed_m_s * dt_s);
  return held;
}

// A panel of the map: one column a value of a variable, one row a stiffness, a colour for each, and the predicted
// bound.
struct Panel {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<double>> fraction;  // by column and row: fraction of holds that oscillate
  std::vector<double> predicted_N_m;          // by column
};

Picture drawMap(const std::string& title, const std::string& subtitle, const std::string& x_label,
                const std::vector<double>& stiffness_N_m, const std::vector<Panel>& panels, std::size_t panel_columns) {
  constexpr int kCell_x = 44, kCell_y = 18, kLeft = 92, kTop = 84, kGap_x = 84, kGap_y = 76;
  const auto columns = static_cast<int>(panels[0].columns.size()), rows = static_cast<int>(stiffness_N_m.size());
  const auto across = static_cast<int>(panel_columns);
  const int down = (static_cast<int>(panels.size()) + across - 1) / across;
  Picture scratch = whitePicture(1, 1);
  Canvas measure(scratch);
  const double words_px = 40 + std::max(measure.textWidth(title, 13), measure.textWidth(subtitle, 9));
  const int width = std::max(static_cast<int>(words_px), kLeft + across * (columns * kCell_x + kGap_x));
  Picture picture = whitePicture(width, kTop + down * (rows * kCell_y + kGap_y) + 8);
  {
    Canvas canvas(picture);
    canvas.text(title, {20, 32}, 13, kInk);
    canvas.text(subtitle, {20, 54}, 9, kGrey);
    const Rgba still{226, 236, 244}, shakes{196, 60, 40};
    const double lo = std::log(stiffness_N_m.front()), step = std::log(stiffness_N_m[1] / stiffness_N_m[0]);
    for (std::size_t p = 0; p < panels.size(); ++p) {
      const Panel& panel = panels[p];
      const std::size_t column = p % panel_columns, below = p / panel_columns;
      const double x0 = kLeft + static_cast<double>(column) * (columns * kCell_x + kGap_x);
      const double y0 = kTop + 16 + static_cast<double>(below) * (rows * kCell_y + kGap_y);
      const double y1 = y0 + rows * kCell_y;
      canvas.text(panel.title, {x0, y0 - 8}, 9.5, kInk);
      for (int c = 0; c < columns; ++c) {
        for (int r = 0; r < rows; ++r) {
          const double x = x0 + c * kCell_x, y = y1 - (r + 1) * kCell_y;
          const double t = panel.fraction[static_cast<std::size_t>(c)][static_cast<std::size_t>(r)];
          canvas.fill(x + 0.5, y + 0.5, x + kCell_x - 0.5, y + kCell_y - 0.5, mix(still, shakes, t));
        }
        canvas.text(panel.columns[static_cast<std::size_t>(c)], {x0 + (c + 0.5) * kCell_x, y1 + 14}, 8.5, kInk,
                    Align::centre);
        const double row = (std::log(panel.predicted_N_m[static_cast<std::size_t>(c)]) - lo) / step + 0.5;
        if (row > 0 && row < rows)
          canvas.line({x0 + c * kCell_x, y1 - row * kCell_y}, {x0 + (c + 1) * kCell_x, y1 - row * kCell_y}, 3, kInk);
      }
      for (int r = 0; r < rows; r += 2)
        canvas.text(std::to_string(std::lround(stiffness_N_m[static_cast<std::size_t>(r)])),
                    {x0 - 6, y1 - (r + 0.5) * kCell_y + 4}, 8.5, kInk, Align::right);
      canvas.text(x_label, {x0 + 0.5 * columns * kCell_x, y1 + 30}, 8.5, kGrey, Align::centre);
    }
  }
  return picture;
}

struct MapCell {
  double bound_N_m = 0;
  int holds = 0, oscillate = 0;
  double swing_m = 0, least_J = 0, over_bound = 0, given_W = 0;  // the largest; over_bound: -least / promised bound
};

MapCell measureCell(const StabilityScene& scene, Hold what, int pulls, std::uint64_t seed, SolverMethod method,
                    const SolverParameters& parameters) {
  MapCell cell;
  cell.bound_N_m =
      stiffnessBound(handParameters(what.hand).damping_Ns_m + what.device_damping_Ns_m, 1 / what.rate_Hz, what.delay);
  for (int i = 0; i < pulls; ++i) {
    what.seed = seed * 1000 + static_cast<std::uint64_t>(i);  // the same pulls in every combination
    const HoldOutcome held = hold(scene, what, method, parameters);
    ++cell.holds;
    cell.oscillate += held.oscillates;
    cell.swing_m = std::max(cell.swing_m, held.swing_m);
    cell.least_J = std::min(cell.least_J, held.least_J);
    cell.over_bound = std::max(cell.over_bound, -held.least_J / held.bound_J);
    cell.given_W = std::max(cell.given_W, held.given_W);
  }
  return cell;
}

constexpr std::array<double, 7> kRatioEdges{0, 0.5, 0.8, 1, 1.25, 2, 1e9};

BenchReport runStability(const BenchOptions& options) {
  BenchReport report;
  const std::vector<double> rates =
      options.quick ? std::vector<double>{500, 1000} : std::vector<double>{250, 500, 1000, 2000, 4000};
  const std::vector<int> delays = options.quick ? std::vector<int>{1} : std::vector<int>{0, 1, 2};
  const std::vector<double> dampings =
      options.quick ? std::vector<double>{0.5} : std::vector<double>{0, 0.5, 1, 2, 5, 10};
  const int pulls = options.quick ? 1 : options.long_run ? 8 : 2;
  std::vector<double> stiffness;
  for (int i = 0; i < (options.quick ? 4 : 18); ++i)
    stiffness.push_back(50 * std::pow(2, options.quick ? 2 * i : 0.5 * i));

  options.progress("growing the neurons");
  const StabilityScene scene(syntheticStore(2, options.seed));
  const SolverMethod method = RunOptions{}.method;
  const SolverParameters parameters = automaticParameters(*scene.store, 0);

  struct Job {
    Hold what;
    MapCell off, on;
  };
  std::vector<Job> jobs;
  for (const char* hand : kHands)
    for (const int delay : delays)
      for (const double rate : rates)
        for (const double k : stiffness) jobs.push_back({{hand, rate, delay, 0.5, k}, {}, {}});
  const std::size_t by_rate = jobs.size();
  for (const char* hand : kHands)
    for (const double damping : dampings)
      for (const double k : stiffness) jobs.push_back({{hand, 1000, 1, damping, k}, {}, {}});
  std::atomic<std::size_t> done{0};
  parallelFor(
      jobs.size(), std::max(1u, std::thread::hardware_concurrency()),
      [&](std::size_t i) {
        Job& job = jobs[i];
        job.what.controller = false;
        job.off = measureCell(scene, job.what, pulls, options.seed, method, parameters);
        job.what.controller = true;
        job.on = measureCell(scene, job.what, pulls, options.seed, method, parameters);
        ++done;
      },
      [&] { options.progress(std::to_string(done) + " of " + std::to_string(jobs.size()) + " cells"); });

  // Grouped by the ratio of stiffness to predicted bound.
  BenchTable bins{
      "by_ratio",
      "Holds by stiffness over the predicted bound b / (T/2 + d T): how many oscillate, the largest swing of "
      "the hand after 3 s (mm), the lowest observed energy (mJ), the largest power given to the hand (mW); "
      "without and with the passivity controller",
      {"K / bound", "holds", "oscillate", "swing", "energy", "power", "with: oscillate", "swing ", "energy ", "power "},
      {}};
  std::int64_t inside = 0, outside_on = 0;
  double worst_bound = 0;
  for (std::size_t bin = 0; bin + 1 < kRatioEdges.size(); ++bin) {
    std::int64_t holds = 0;
    MapCell off, on;
    for (const Job& job : jobs) {
      const double ratio = job.what.stiffness_N_m / job.off.bound_N_m;
      if (!(ratio >= kRatioEdges[bin] && ratio < kRatioEdges[bin + 1])) continue;
      holds += job.off.holds;
      for (const auto& [sum, one] : {std::pair<MapCell*, const MapCell*>{&off, &job.off}, {&on, &job.on}}) {
        sum->oscillate += one->oscillate;
        sum->swing_m = std::max(sum->swing_m, one->swing_m);
        sum->least_J = std::min(sum->least_J, one->least_J);
        sum->given_W = std::max(sum->given_W, one->given_W);
        sum->over_bound = std::max(sum->over_bound, one->over_bound);
      }
    }
    if (kRatioEdges[bin + 1] <= 1) inside += off.oscillate;
    outside_on += on.oscillate;
    worst_bound = std::max(worst_bound, on.over_bound);
    std::string name = shortNumber(kRatioEdges[bin]) +
                       (bin + 2 == kRatioEdges.size() ? " and more" : " to " + shortNumber(kRatioEdges[bin + 1]));
    bins.rows.push_back({name, holds, std::int64_t{off.oscillate}, 1e3 * off.swing_m, 1e3 * off.least_J,
                         1e3 * off.given_W, std::int64_t{on.oscillate}, 1e3 * on.swing_m, 1e3 * on.least_J,
                         1e3 * on.given_W});
  }
  report.tables.push_back(std::move(bins));

  BenchTable limits{"limits",
                    "Device damping 0.5 N s/m: predicted bound (N/m), the lowest stiffness of the grid at which a hold "
                    "oscillates, without and with the controller (0: none up to the grid's end)",
                    {"hand", "delay", "rate_Hz", "predicted", "oscillates_from", "over_predicted", "with_controller"},
                    {},
                    {"hand", "delay", "rate_Hz"}};
  std::vector<Panel> off_panels, on_panels, damping_panels;
  std::vector<PlotSeries> first_unstable, predicted;
  const auto addColumn = [&](Panel& panel, std::size_t first, bool on) {
    panel.fraction.emplace_back();
    for (std::size_t r = 0; r < stiffness.size(); ++r) {
      const MapCell& cell = on ? jobs[first + r].on : jobs[first + r].off;
      panel.fraction.back().push_back(static_cast<double>(cell.oscillate) / cell.holds);
    }
    panel.predicted_N_m.push_back(jobs[first].off.bound_N_m);
  };
  std::size_t at = 0;
  for (const char* hand : kHands) {
    for (const int delay : delays) {
      const std::string title = std::string(hand) + " hand, delay " + std::to_string(delay);
      Panel off{title, {}, {}, {}}, on{title, {}, {}, {}};
      for (const double rate : rates) {
        const auto from = [&](bool with) {
          for (std::size_t r = 0; r < stiffness.size(); ++r)
            if ((with ? jobs[at + r].on : jobs[at + r].off).oscillate > 0) return stiffness[r];
          return 0.0;
        };
        const double bound = jobs[at].off.bound_N_m;
        if (delay == 1) {
          const auto put = [&](std::vector<PlotSeries>& all, const std::string& name, double y, bool broad) {
            if (all.empty() || all.back().name != name) all.push_back({name, {}, {}, false, broad});
            all.back().x.push_back(rate), all.back().y.push_back(y);
          };
          put(first_unstable, std::string(hand) + " hand", from(false), false);
          put(predicted, std::string(hand) + ", predicted", bound, true);
        }
        limits.rows.push_back({std::string(hand), std::int64_t{delay}, std::int64_t{std::lround(rate)}, bound,
                               from(false), from(false) / bound, from(true)});
        for (Panel* panel : {&off, &on}) {
          panel->columns.push_back(shortNumber(rate));
          addColumn(*panel, at, panel == &on);
        }
        at += stiffness.size();
      }
      off_panels.push_back(std::move(off));
      on_panels.push_back(std::move(on));
    }
  }
  report.tables.push_back(std::move(limits));
  if (rates.size() > 2) {
    std::vector<PlotSeries> series = first_unstable;
    series.insert(series.end(), predicted.begin(), predicted.end());
    BenchCurve curve = tradeCurve("rate", "Haptic rate: the stiffness from which holds vibrate, delay of one sample",
                                  "rate (Hz)", "stiffness (N/m)", series, true, true);
    addLine(curve, 1000, "default");
    double least_loose = INFINITY;
    for (const PlotSeries& one : predicted)
      for (std::size_t i = 0; i < one.x.size(); ++i)
        if (one.x[i] == 1000) least_loose = std::min(least_loose, one.y[i]);
    curve.finding =
        "The bound is proportional to the rate, without a knee: every rate is as good as its stiffness. At "
        "1 kHz the lowest of the three hands' bounds is " +
        shown(least_loose) + " N/m, " + shown(least_loose / 200) +
        " times the default of 200; devices are made for 1 kHz.";
    report.curves.push_back(std::move(curve));
  }
  at = by_rate;
  for (const char* hand : kHands) {
    Panel panel{std::string(hand) + " hand, 1 kHz, delay 1", {}, {}, {}};
    for (const double damping : dampings) {
      panel.columns.push_back(shortNumber(damping));
      addColumn(panel, at, false);
      at += stiffness.size();
    }
    damping_panels.push_back(std::move(panel));
  }
  const std::string key = "rows: stiffness, N/m; red: holds that oscillate; bar: predicted bound b / (T/2 + d T)";
  const auto picture = [&](const std::string& file, const Picture& drawn) {
    writePng(drawn, options.out + "/" + file);
    report.pictures.push_back(file);
  };
  picture("stability-map.png", drawMap("Holds that oscillate: stiffness against rate, delay and hand", key, "rate, Hz",
                                       stiffness, off_panels, delays.size()));
  picture("stability-map-controller.png",
          drawMap("The same with the passivity controller on", key, "rate, Hz", stiffness, on_panels, delays.size()));
  picture("stability-map-damping.png", drawMap("Holds that oscillate: stiffness against the device's damping", key,
                                               "device damping, N s/m", stiffness, damping_panels, 3));

  // On tours: the energy that the proxy's moves inject, and the cost of the controller where it is not needed.
  BenchTable tours{
      "tours",
      "A tour through synthetic neurons, medium hand, 1 kHz, delay 1: energy added to the spring by moves of "
      "the proxy (mJ a s), by the largest one (mJ), lowest observed energy (mJ), force and way; without and "
      "with the controller",
      {"method", "K_N_m", "controller", "injected_mJ_s", "largest_mJ", "least_mJ", "acted_percent", "mean_N",
       "reached_um", "legs_completed"},
      {},
      {"method", "K_N_m", "controller"}};
  double cost = 0;
  const auto store = syntheticStore(options.quick ? 2 : 12, options.seed + 1);
  for (const SolverMethod one : kSolverMethods) {
    const char* name = toString(one);
    for (const double k : {200.0, 3000.0, 10000.0}) {
      std::array<RunSummary, 2> runs;
      for (const bool on : {false, true}) {
        options.progress(std::string("tour, ") + name);
        RunOptions run_options;
        run_options.in_memory = true;
        run_options.route = {.kind = RouteChoice::Kind::tour, .seed = options.seed};
        run_options.seconds = options.quick ? 2 : options.long_run ? 120 : 30;
        run_options.method = one;
        run_options.stiffness_N_m = k;
        run_options.passivity = on;
        run_options.seed = options.seed;
        const RunSummary s = run(*store, run_options);
        tours.rows.push_back({std::string(name), k, std::string(on ? "on" : "off"), 1e3 * s.energy.injected / s.sim_s,
                              1e3 * s.energy.injected_most, 1e3 * s.energy.least,
                              100.0 * static_cast<double>(s.energy.acted) / static_cast<double>(s.ticks),
                              s.mean_force_N, s.reached_um, static_cast<std::int64_t>(s.legs_completed)});
        runs[on] = s;
      }
      if (one == method && k == 200) cost = runs[1].force_integral_Ns / runs[0].force_integral_Ns;
    }
  }
  report.tables.push_back(std::move(tours));

  options.progress("the energy of the whole loop");
  const std::uint64_t runs = options.quick ? 100 : options.long_run ? 20000 : 2000;
  const EnergySweep energy = energySweep(options.seed, runs, 4);
  report.tables.push_back(
      {"energy",
       "The whole loop from tick to motors, controller on, in virtual time: runs of 4 s with ticks that stall, a guard "
       "that sends zero, states that stand still, force that is withheld, jumps and changes of mode, devices that "
       "clamp "
       "and ramp. The energy given in any window beyond the bound (J), the most given in a window (J), the most that "
       "no sample shows (J)",
       {"runs", "ticks", "stalls", "stale", "withheld", "commands", "beyond_J", "worst_seed", "most_given_J",
        "unseen_J"},
       {{static_cast<std::int64_t>(energy.runs), static_cast<std::int64_t>(energy.ticks),
         static_cast<std::int64_t>(energy.stalls), static_cast<std::int64_t>(energy.stale),
         static_cast<std::int64_t>(energy.withheld), static_cast<std::int64_t>(energy.commands), energy.beyond_J,
         static_cast<std::int64_t>(energy.worst), energy.most_given_J, energy.unseen_J}}});

  report.goals.push_back({"energy given beyond the bound by the whole loop, controller on, J", "0", "0",
                          energy.beyond_J, energy.beyond_J == 0, energy.beyond_J == 0});
  report.goals.push_back({"holds that oscillate inside the predicted region, controller off", "0", "0",
                          static_cast<double>(inside), inside == 0, inside == 0});
  report.goals.push_back({"lowest energy with the controller on, over the stated bound", "<= 1", "<= 1", worst_bound,
                          worst_bound <= 1, worst_bound <= 1});
  report.goals.push_back({"holds that oscillate anywhere, controller on", "-", "0", static_cast<double>(outside_on),
                          true, outside_on == 0});
  report.goals.push_back({"mean force on a tour at K 200, controller on over off", "<= 1.05", "<= 1.01", cost,
                          cost <= 1.05, cost <= 1.01});
  report.notes.push_back(
      "hold: the hand's target steps away by 2 to 15 mm from a place of a synthetic neuron and rests; "
      "oscillates: after 3 s it still swings by more than 20 um in each of four quarters of a second, "
      "the last at least 0.8 of the first; " +
      std::to_string(pulls) + " pulls a cell, the same in each; 300 um across 12 cm; no tremor");
  report.notes.push_back("controller: energy 1 mJ, power 0.1 mW, recovery 0.2 a second, damping at most 5 N s/m");
  return report;
}

}  // namespace

void addStabilityWorkloads(std::vector<Workload>& all) {
  all.push_back(
      {"stability", "where rendering vibrates: stiffness against rate, delay, damping and hand", runStability});
}

}  // namespace filiform::tools
