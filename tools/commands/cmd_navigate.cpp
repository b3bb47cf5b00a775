// filiform navigate: a simulated or recorded hand travels a route without a display.
#include "device/factory/device_factory.h"
#include "index/errors.h"
#include "index/file/faulty_source.h"
#include "index/output.h"
#include "index/remote/http_source.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "solver/force/force_hold.h"
#include "solver/travel/run/run.h"
#include "solver/workspace/workspace.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/commands/shared/scene.h"
#include "tools/commands/shared/travel_report.h"
#include "tools/program/cli.h"
#include "tools/program/ending_watch.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/cell_name.h"
#include "tools/words/numbers.h"
#include "viewer/gl/graphics_context.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string_view>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct NavigateArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string scene, cell, method = "climb", hand, device, budget, prefetch = "structure", delays = "constant", record,
                           csv, fault_csv, plot, picture;
  std::string route = "longest";
  double zoom_um = 300, leap = 1, rate_Hz = 1000, latency_ms = 0;
  std::string passivity = "auto";
  std::vector<std::string> given;  // options of the command line, for a replay
  std::optional<double> seconds, speed_m_s, stiffness_N_m;
  std::uint64_t seed = 1;
  unsigned io_threads = 0;
  bool realtime = false, json = false;
};

constexpr double kMostRate_Hz = 1e6;  // as run() requires

PrefetchPolicy prefetchPolicy(const std::string& name) {
  if (name == "none") return PrefetchPolicy::none;
  if (name == "distance") return PrefetchPolicy::distance;
  if (name == "structure") return PrefetchPolicy::structure;
  throw UsageError("--prefetch " + inShort(name) + ": choose none, distance or structure");
}

FaultPlan::Delay delayKind(const std::string& name) {
  if (name == "constant") return FaultPlan::Delay::constant;
  if (name == "uniform") return FaultPlan::Delay::uniform;
  if (name == "exponential") return FaultPlan::Delay::exponential;
  throw UsageError("--latency-kind " + inShort(name) + ": choose constant, uniform or exponential");
}

// With --realtime, --latency delays the reads of the set's files.
std::unique_ptr<TileStore> openScene(const NavigateArguments& a, bool& in_memory) {
  in_memory = isFileScene(a.scene);
  if (!in_memory && !(a.realtime && a.latency_ms > 0)) return TileSet::open(a.scene, a.remote->options());
  if (!in_memory) {
    FaultPlan plan{.delay = delayKind(a.delays), .delay_s = 1e-3 * a.latency_ms, .seed = a.seed};
    auto source = std::make_unique<FaultySource>(openSource(a.scene, a.remote->options()), std::move(plan));
    FaultySource& slow = *source;
    auto set = TileSet::open(std::move(source));
    slow.arm();
    return set;
  }
  return buildScene(a.scene);
}

// The file of --fault-csv; without that option a file beside --csv, if --csv is a regular file.
std::string faultCsvOf(const NavigateArguments& a) {
  if (!a.fault_csv.empty() || !isFileOutput(a.csv)) return a.fault_csv;
  return a.csv + ".fault.csv";
}

RunOptions optionsOf(const NavigateArguments& a, const TileStore& store, bool in_memory) {
  RunOptions options;
  options.in_memory = in_memory;
  options.method = solverMethod(a.method);
  options.route = routeChoiceOf(a.route);
  options.seconds = a.seconds;
  if (!a.hand.empty() && !a.device.empty()) throw UsageError("--hand is short for --device sim:HAND: give one of them");
  if (!a.hand.empty()) options.device = "sim:" + a.hand;
  if (!a.device.empty()) options.device = a.device;
  options.stiffness_N_m = a.stiffness_N_m;
  if (a.passivity != "auto" && a.passivity != "on" && a.passivity != "off")
    throw UsageError("--passivity " + inShort(a.passivity) + ": choose auto, on or off");
  if (a.passivity != "auto") options.passivity = a.passivity == "on";
  options.zoom_um = a.zoom_um;
  options.leap = a.leap;
  if (!(a.rate_Hz > 0 && a.rate_Hz <= kMostRate_Hz))
    throw UsageError("--rate " + formatNumber(a.rate_Hz) + ": give more than 0 and at most " +
                     std::to_string(static_cast<int>(kMostRate_Hz)) + " ticks a second");
  options.rate_Hz = a.rate_Hz;
  if (a.speed_m_s) options.person.speed_m_s = *a.speed_m_s;
  options.seed = a.seed;
  if (!a.budget.empty()) {
    const std::uint64_t budget = parseBytes("--budget", a.budget);
    if (in_memory) throw UsageError("--budget is for tile sets: an .swc or .zip file is read into memory as a whole");
    options.budget_bytes = budget;
  }
  if (in_memory && a.latency_ms != 0)
    throw UsageError("--latency is for tile sets: an .swc or .zip file is read once, before the travel");
  if (a.delays != "constant" && !(a.realtime && a.latency_ms > 0))
    throw UsageError("--latency-kind " + inShort(a.delays) + ": give --realtime and --latency MS too");
  // In real time openScene() delays the files.
  options.latency_ms = a.realtime ? 0 : a.latency_ms;
  options.io_threads = a.io_threads != 0 ? a.io_threads : a.realtime && a.latency_ms > 0 ? 16 : 0;
  options.prefetch = prefetchPolicy(a.prefetch);
  options.realtime = a.realtime;
  options.record = a.record;
  options.given = a.given;
  options.fault_csv = faultCsvOf(a);
  options.stop = &interruptFlag();
  options.recording_kept = [](const std::string& path) {
    std::cerr << "filiform: note: the recording so far is in " << inShort(path) << '\n';
  };
  if (!a.cell.empty()) options.cell = findCellNamed(store, a.cell);
  return options;
}

nlohmann::ordered_json timesJson(const TimeHistogram& times) {
  const auto us = [](double ns) { return ns / 1000; };
  return {{"mean_us", us(times.mean_ns())},
          {"p50_us", us(static_cast<double>(times.percentile_ns(0.5)))},
          {"p99_us", us(static_cast<double>(times.percentile_ns(0.99)))},
          {"p99.9_us", us(static_cast<double>(times.percentile_ns(0.999)))},
          {"p99.99_us", us(static_cast<double>(times.percentile_ns(0.9999)))},
          {"max_us", us(static_cast<double>(times.max_ns()))}};
}

// Why the run failed, or met tiles that could not be read; empty if all is well.
std::string causeOf(const RunSummary& s) {
  if (!s.error.empty() || s.failures.empty()) return s.error;
  if (s.failures.size() == 1) return s.failures.front();
  return s.failures.front() + " (and " + std::to_string(s.failures.size() - 1) + " more reads failed)";
}

// Requests an hour, at the pace of the run.
double hourly(const RemoteCounters& network, const RunSummary& s) {
  return s.sim_s > 0 ? static_cast<double>(network.requests) / s.sim_s * 3600 : 0;
}

// `error`: beside the run's own, of what follows the run.
nlohmann::ordered_json summaryJson(const RunSummary& s, const std::optional<RemoteCounters>& network,
                                   const std::string& error) {
  nlohmann::ordered_json json{{"outcome", toString(s.outcome)},
                              {"route_um", s.route_um},
                              {"reached_um", s.reached_um},
                              {"ticks", s.ticks},
                              {"sim_s", s.sim_s},
                              {"segments", s.segments},
                              {"tiles", s.tiles},
                              {"tiles_read", s.tiles_read},
                              {"evictions", s.evictions},
                              {"stalls", s.stalls},
                              {"frontiers", s.frontiers},
                              {"peak_bytes", s.peak_bytes},
                              {"budget_bytes", nullptr},
                              {"decoded_bytes", s.decoded_bytes},
                              {"mean_force_N", s.mean_force_N},
                              {"max_force_N", s.max_force_N},
                              {"force_integral_Ns", s.force_integral_Ns},
                              {"max_force_step_N", s.max_force_step_N},
                              {"missed_deadlines", nullptr}};
  if (s.budget_bytes) json["budget_bytes"] = *s.budget_bytes;
  if (s.missed_deadlines) json["missed_deadlines"] = *s.missed_deadlines;
  json["cell"] = s.cell;
  json["visited"] = s.visited;
  json["capped_ticks"] = s.capped_ticks;
  json["back_offs"] = s.back_offs;
  json["stiffness_N_m"] = s.stiffness_N_m;
  json["passivity"] = s.passivity;
  json["least_energy_J"] = s.energy.least;
  json["injected_energy_J"] = s.energy.injected;
  json["passivity_ticks"] = s.energy.acted;
  json["legs"] = s.legs;
  json["legs_completed"] = s.legs_completed;
  json["jumps"] = s.jumps;
  json["jump_wait_ticks"] = s.jump_wait_ticks;
  json["jump_wait"] = timesJson(s.jump_waits);
  const ResidencyCounters& c = s.streaming;
  json["streaming"] = {{"prefetched", c.prefetched},
                       {"prefetch_used", c.prefetch_used},
                       {"prefetch_wasted", c.prefetch_wasted},
                       {"cancelled", c.cancelled},
                       {"missed_unclaimed", c.missed_unclaimed},
                       {"missed_full", c.missed_full},
                       {"missed_late", c.missed_late},
                       {"missed_evicted", c.missed_evicted},
                       {"missed_failed", c.missed_failed},
                       {"bytes_read_decoded", c.bytes_read_decoded},
                       {"peak_queued", c.peak_queued},
                       {"wait_mean", c.waits > 0 ? c.wait_sum / static_cast<double>(c.waits) : 0.0},
                       {"wait_most", c.wait_most}};
  json["network"] = nullptr;
  if (network)
    json["network"] = {{"requests", network->requests},     {"retries", network->retries},
                       {"merged", network->merged},         {"bytes", network->bytes},
                       {"cache_hits", network->cache_hits}, {"requests_an_hour", std::round(hourly(*network, s))}};
  json["loop"] = nullptr;
  if (s.loop)
    json["loop"] = {{"wake", timesJson(s.loop->metrics.wake())},
                    {"compute", timesJson(s.loop->metrics.compute())},
                    {"exchange", timesJson(s.loop->metrics.exchange())},
                    {"period", timesJson(s.loop->metrics.period())},
                    {"stale_ticks", s.loop->stale_ticks},
                    {"interruptions", s.loop->interruptions},
                    {"guard_exchanges", s.loop->guard_exchanges}};
  const std::string why = !error.empty() ? error : causeOf(s);
  json["error"] = why.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(why);
  json["failures"] = s.failures;
  return json;
}

std::string rounded(double value, int decimals) {
  const double factor = std::pow(10, decimals);
  return formatNumber(std::round(value * factor) / factor);
}

const char* explanationOf(RunOutcome outcome) {
  switch (outcome) {
    case RunOutcome::completed:
      return "";
    case RunOutcome::stuck:
      return ": the hand gave up, or its recording ended, before the end of the route";
    case RunOutcome::time_over:
      return ": the time limit came before the end of the route; --seconds allows more";
    case RunOutcome::interrupted:
      return ": a signal came before the end of the route";
    case RunOutcome::failed:
      return ": ended by an error";
  }
  return "";
}

void describeForPeople(std::ostream& out, const RunSummary& s, const std::optional<RemoteCounters>& network) {
  const auto line = [&out](const std::string& what, const std::string& value) {
    out << "  " << what << std::string(what.size() < 22 ? 22 - what.size() : 1, ' ') << value << '\n';
  };
  out << "cell " << escaped(s.cell) << ", route " << escaped(s.route) << ", method " << toString(s.method) << ": "
      << toString(s.outcome) << explanationOf(s.outcome) << '\n';
  if (s.jumps > 0 || s.legs_completed > 1)
    line("tour", counted(s.legs, "route") + " begun, " + formatCount(s.legs_completed) + " completed; " +
                     counted(s.jumps, "jump") + ", " + counted(s.jump_wait_ticks, "tick") + " of waiting for them");
  line("route", rounded(s.route_um, 1) + " um, reached " + rounded(s.reached_um, 1) + " um");
  line("time", rounded(s.sim_s, 2) + " s, " + counted(s.ticks, "tick"));
  line("force", "mean " + rounded(s.mean_force_N, 3) + " N, largest " + rounded(s.max_force_N, 3) + " N, integral " +
                    rounded(s.force_integral_Ns, 2) + " N s");
  line("largest force step", rounded(s.max_force_step_N, 4) + " N from one tick to the next");
  line("energy",
       "least " + rounded(1e3 * s.energy.least, 4) + " mJ, injected by the proxy " +
           rounded(1e3 * s.energy.injected, 4) + " mJ" +
           (s.passivity ? "; the passivity controller acted in " + counted(s.energy.acted, "tick") : std::string()));
  line("segments in the set", formatCount(s.segments));
  line("tiles touched", formatCount(s.tiles));
  line("tiles read", formatCount(s.tiles_read) + ", evicted " + formatCount(s.evictions));
  line("memory for tiles", formatBytes(s.peak_bytes) + " at most, of " + formatBytes(s.decoded_bytes) +
                               " in the whole set" +
                               (s.budget_bytes ? "; budget " + formatBytes(*s.budget_bytes) : std::string()));
  line("stalls", formatCount(s.stalls) + "  (ticks repeated after a tile was read; the hand does not feel them)");
  line("frontiers", formatCount(s.frontiers) + "  (ticks at which the proxy waited for an absent tile)");
  if (network)
    line("network", counted(network->requests, "request") + ", " + formatBytes(network->bytes) + "; " +
                        counted(network->merged, "read") + " shared one, " + formatCount(network->cache_hits) +
                        " came from the cache; " + counted(static_cast<std::uint64_t>(hourly(*network, s)), "request") +
                        " an hour at this pace");
  if (s.capped_ticks > 0) line("capped ticks", formatCount(s.capped_ticks) + "  (the search went on at the next tick)");
  if (s.missed_deadlines) line("missed deadlines", formatCount(*s.missed_deadlines) + " of " + formatCount(s.ticks));
  if (s.loop) {
    const auto us = [](std::int64_t ns) { return rounded(1e-3 * static_cast<double>(ns), 0); };
    const LoopMetrics& m = s.loop->metrics;
    line("haptic loop", "compute p50 " + us(m.compute().percentile_ns(0.5)) + ", p99.99 " +
                            us(m.compute().percentile_ns(0.9999)) + ", most " + us(m.compute().max_ns()) +
                            " us; woke late p99 " + us(m.wake().percentile_ns(0.99)) + ", most " +
                            us(m.wake().max_ns()) + " us; interrupted " + formatCount(s.loop->interruptions));
  }
  if (!s.missed_deadlines) line("missed deadlines", "none possible in virtual time (--realtime counts them)");
}

// The name of the cell on which the proxy is, for the CSV. Keeps the last name, because the cell seldom changes.
class CellNames {
 public:
  explicit CellNames(const TileStore& store) : store_(store) {}
  const std::string& of(std::uint32_t cell) {
    if (cell != cell_) {
      cell_ = cell;
      name_ = cell < store_.cell_count() ? escaped(store_.cell(cell).name) : "";
    }
    return name_;
  }

 private:
  const TileStore& store_;
  std::uint32_t cell_ = UINT32_MAX;
  std::string name_;
};

void checkPaths(const NavigateArguments& a) {
  std::vector<NamedPath> inputs{{"SCENE", a.scene}};
  inputs.push_back({"--device", fileOfDevice(a.device)});
  std::vector<NamedPath> outputs{
      {"--csv", a.csv}, {"--record", a.record}, {"--plot", a.plot}, {"--picture", a.picture}};
  if (a.realtime) outputs.push_back({"--fault-csv", faultCsvOf(a)});
  if (a.json) outputs.push_back({"--json", "-"});
  checkOutputs(inputs, outputs);
}

// Keeps the rows of a run that did not end well: in their file, or beside an older one.
void keepRows(std::optional<Output>& csv, const RunSummary& so_far) {
  if (!csv || so_far.ticks == 0) return;
  try {
    const std::string kept = csv->finishAside();
    if (csv->isFile()) std::cerr << "filiform: note: the rows so far are in " + escaped(kept) + "\n";
  } catch (const Error&) {
    // The run's error is reported.
  }
}

int runNavigate(const NavigateArguments& a) {
  checkPaths(a);
  bool in_memory = false;
  const std::unique_ptr<TileStore> store = openScene(a, in_memory);
  RunOptions options = optionsOf(a, *store, in_memory);

  std::optional<Output> csv;
  if (!a.csv.empty()) {
    csv.emplace(a.csv, OutputOptions{.cancel = &interruptFlag(), .mend = cutToWholeLines});
    writeCsvHeader(csv->stream());
  }
  const bool takes_stdout =
      isStandardOutput(a.csv) || isStandardOutput(a.record) || isStandardOutput(a.plot) || isStandardOutput(a.picture);
  std::unique_ptr<TravelReport> travel;
  if (!a.plot.empty() || !a.picture.empty()) travel = std::make_unique<TravelReport>();
  CellNames cell_names(*store);
  Progress progress({.title = "navigate", .noun = "ticks"});
  const auto* const set = dynamic_cast<const TileSet*>(store.get());
  const auto report = [&](const RunSummary& summary, const std::string& error) {
    const std::optional<RemoteCounters> network = set != nullptr ? set->remoteCounters() : std::nullopt;
    if (a.json)
      std::cout << summaryJson(summary, network, error).dump(1, ' ', true, nlohmann::json::error_handler_t::replace)
                << '\n';
    else if (summary.outcome != RunOutcome::failed)
      describeForPeople(takes_stdout ? std::cerr : std::cout, summary, network);
  };

  if (options.realtime) holdForcesOnSignals();
  RunSummary summary, made;
  try {
    // For the run alone: drawing and writing may take longer.
    EndingWatch watch = watchForSilentFiles([&] {
      keepRows(csv, summary);
      report(summary, "");
      return causeOf(summary);
    });
    options.ending = [&](const RunSummary& so_far) {
      summary = so_far;
      watch.begin();
    };
    made = run(*store, options, [&](const TickRow& row) {
      if (csv) writeCsvRow(csv->stream(), row, cell_names.of(row.segment.cell));
      if (travel) travel->add(row);
      progress.update(row.tick);
    });
  } catch (...) {
    progress.finish();
    keepRows(csv, summary);
    if (summary.outcome == RunOutcome::failed) report(summary, "");
    throw;
  }
  progress.finish();
  summary = std::move(made);  // now that the watch has ended
  const bool interrupted = summary.outcome == RunOutcome::interrupted;
  std::vector<std::string> errors;  // of the files beside the recording: each is written even if another one fails
  const auto written = [&errors](const std::string& option, const auto& write) {
    try {
      write();
    } catch (const IoError& error) {
      errors.emplace_back(error.what());
    } catch (const GraphicsError& error) {  // there is no OpenGL
      errors.push_back(option + ": " + error.what());
    }
  };
  if (csv && !interrupted) written("--csv", [&] { csv->finish(); });
  if (csv && (interrupted || !errors.empty())) keepRows(csv, summary);
  const std::string title = escaped(summary.cell + ", " + summary.route + ", " + toString(summary.method));
  if (!a.plot.empty() && !interrupted) written("--plot", [&] { travel->writeForcePlot(a.plot, title, summary); });
  if (!a.picture.empty() && !interrupted)
    written("--picture " + escaped(a.picture), [&] { travel->writePicture(a.picture, title, summary, *store); });

  report(summary, errors.empty() ? "" : errors.front());
  for (const std::string& note : summary.notes) std::cerr << "filiform: note: " << note << '\n';
  if (interrupted && travel)
    std::cerr << "filiform: note: interrupted: the files of --plot and --picture were not written\n";
  if (const std::string cause = causeOf(summary); !cause.empty()) std::cerr << "filiform: " << cause << '\n';
  for (const std::string& error : errors) std::cerr << "filiform: " << error << '\n';
  if (interrupted) return interruptedExitCode();
  if (!errors.empty()) return 3;
  return summary.failures.empty() ? 0 : 1;
}

}  // namespace

void addNavigate(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<NavigateArguments>();
  CLI::App* command = app.add_subcommand("navigate", "Travel a route with a simulated or recorded hand");
  command->footer(
      "Example:\n  filiform navigate column.fil --route longest --zoom 300 --budget 4MiB --csv travel.csv --plot "
      "force.png\n"
      "  filiform navigate cell.swc --route 1:245 --method basic\n"
      "  filiform navigate column.fil --route tour:1 --seconds 600 --budget 64MiB --realtime --json");
  command->add_option("SCENE", a->scene, "tile set or its address, .swc file or small .zip (read into memory)")
      ->required()
      ->type_name("SET|FILE.swc");
  command->add_option("--cell", a->cell, "travel on this cell; default: the cell with the most segments");
  command
      ->add_option("--route", a->route,
                   "travel ROOT:TIP (sample ids), longest, random:SEED, or tour:SEED: random routes, one after "
                   "the other, through --cell or all cells")
      ->capture_default_str();
  command->add_option("--seconds", a->seconds,
                      "stop after this simulated time; default: 10 times the nominal time + 20 s, a tour 60 s");
  command->add_option("--method", a->method, "find the proxy with basic, shading, force, force-listing or climb")
      ->capture_default_str();
  command
      ->add_option("--leap", a->leap,
                   "multiply climb's range in a tick by this factor: 0 follows the neurite, 1 needs the least force")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--hand", a->hand, "simulate a loose, medium or firm hand: short for --device sim:HAND");
  command->add_option("--device", a->device, "use " + std::string(deviceChoices()) + "; default sim:medium");
  command->add_option("--stiffness", a->stiffness_N_m,
                      "stiffness of the spring to the proxy, N/m; default 200, 50 with the loose hand, less where "
                      "hardware allows less");
  command
      ->add_option("--passivity", a->passivity,
                   "bound the energy given to the hand: auto (if the stiffness is outside the stability bound), on or "
                   "off")
      ->capture_default_str();
  command->add_option("--zoom", a->zoom_um, "show this much tissue, um, across 0.12 m of device")
      ->capture_default_str()
      ->type_name("UM")
      ->check(CLI::Range(Workspace::kMinZoom_um, Workspace::kMaxZoom_um));
  command->add_option("--speed", a->speed_m_s, "speed of the hand's aim, m/s in device space")->type_name("M_PER_S");
  command->add_option("--rate", a->rate_Hz, "ticks a second")->capture_default_str()->type_name("HZ");
  command->add_option("--seed", a->seed, "seed of the hand's tremor")->capture_default_str();
  command->add_option("--budget", a->budget, "use at most this memory for tiles; default: no limit")
      ->type_name("BYTES");
  command
      ->add_option("--latency", a->latency_ms,
                   "let each tile read take this long, ms; with --realtime, added to the real time")
      ->capture_default_str()
      ->type_name("MS")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--latency-kind", a->delays,
                   "constant, uniform or exponential latency, with --realtime; --latency is the mean")
      ->capture_default_str()
      ->type_name("KIND");
  command
      ->add_option("--io-threads", a->io_threads,
                   "reads in parallel with --realtime; 0: 1, 8 to 64 from an address, 16 with --latency")
      ->capture_default_str();
  command->add_option("--prefetch", a->prefetch, "read tiles ahead by distance or structure; none: only on demand")
      ->capture_default_str();
  command->add_flag("--realtime", a->realtime, "run in real time, with a haptic and an IO thread");
  command->add_option("--record", a->record, "write the exchanges with the device, for --device replay:FILE")
      ->type_name("FILE");
  command->add_option("-o,--output,--csv", a->csv, "write one row a tick; - for standard output")->type_name("FILE");
  command
      ->add_option("--fault-csv", a->fault_csv,
                   "write the last ticks of a real-time loop that ends by a fault; default: FILE.fault.csv "
                   "beside --csv, if --csv is a regular file")
      ->type_name("FILE");
  command->add_option("--plot", a->plot, "write the force curve as PNG")->type_name("FILE");
  command->add_option("--picture", a->picture, "draw the scene from the front, with the path of the proxy, as PNG")
      ->type_name("FILE");
  command->add_flag("--json", a->json, "write the summary as one JSON object");
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, command, &chosen] {
    chosen = [a, command] {
      a->given = givenOptions(*command);
      return runNavigate(*a);
    };
  });
}

}  // namespace filiform::tools
