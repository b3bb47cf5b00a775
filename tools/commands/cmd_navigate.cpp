// filiform navigate: a simulated or recorded hand travels a route without a display.
#include "device/factory/device_factory.h"
#include "device/recording/replay.h"
#include "index/errors.h"
#include "index/file/faulty_source.h"
#include "index/output.h"
#include "index/remote/http_source.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "solver/force/force_hold.h"
#include "solver/travel/run/run.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/commands/shared/scene.h"
#include "tools/commands/shared/travel_report.h"
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
  double zoom_um = 300, rate_Hz = 1000, latency_ms = 0;
  std::string passivity = "auto", as_options;
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
  options.route = a.route;
  options.seconds = a.seconds;
  if (!a.hand.empty() && !a.device.empty()) throw UsageError("--hand is short for --device sim:HAND: give one of them");
  if (!a.hand.empty()) options.device = "sim:" + a.hand;
  if (!a.device.empty()) options.device = a.device;
  options.stiffness_N_m = a.stiffness_N_m;
  if (a.passivity != "auto" && a.passivity != "on" && a.passivity != "off")
    throw UsageError("--passivity " + inShort(a.passivity) + ": choose auto, on or off");
  if (a.passivity != "auto") options.passivity = a.passivity == "on";
  options.zoom_um = a.zoom_um;
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
  options.record_options = a.as_options;
  options.fault_csv = faultCsvOf(a);
  options.stop = &interruptFlag();
  options.recording_kept = [](const std::string& path) {
    std::cerr << "filiform: note: the recording so far is in " << inShort(path) << '\n';
  };
  if (!a.cell.empty()) options.cell = findCellNamed(store, a.cell);
  return options;
}

// The options that decide the travel, beside scene and device. A recording stores them, so that a replay needs only the
// file.
constexpr const char* kRepeated[] = {"--cell",      "--route", "--seconds", "--method", "--stiffness",
                                     "--passivity", "--zoom",  "--speed",   "--rate",   "--seed"};

std::string toldOptions(const CLI::App& command) {
  nlohmann::json told = nlohmann::json::object();
  for (const char* const name : kRepeated) {
    const CLI::Option* const option = command.get_option(name);
    const std::string value = option->count() > 0 ? option->results().front() : option->get_default_str();
    if (!value.empty()) told[name] = value;
  }
  return told.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

// Takes the options of the recorded run that are not given now.
void tellAgain(CLI::App& command, const std::string& device) {
  constexpr std::string_view kReplay = "replay:";
  if (device.rfind(kReplay, 0) != 0) return;
  const std::string file = device.substr(kReplay.size());
  const auto told = nlohmann::json::parse(readRecordingWords(file).options, nullptr, false);
  std::string taken;
  for (const char* const name : kRepeated) {
    CLI::Option* const option = command.get_option(name);
    if (option->count() > 0 || !told.is_object() || !told.contains(name) || !told.at(name).is_string()) continue;
    const std::string value = told.at(name);
    if (value == option->get_default_str()) continue;
    try {
      option->add_result(value);
      option->run_callback();
    } catch (const CLI::Error&) {
      throw UsageError(inShort(file) + ": recorded with " + name + " " + inShort(value) +
                       ", which this program does not accept");
    }
    (((taken += ' ') += name) += ' ') += inShort(value);
  }
  if (!taken.empty()) std::cerr << "filiform: note: options taken from the recording:" << taken << '\n';
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

// Requests an hour, at the pace of the run.
double hourly(const RemoteCounters& network, const RunSummary& s) {
  return s.sim_s > 0 ? static_cast<double>(network.requests) / s.sim_s * 3600 : 0;
}

nlohmann::ordered_json summaryJson(const RunSummary& s, const std::optional<RemoteCounters>& network) {
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
  }
  return "";
}

void describeForPeople(std::ostream& out, const RunSummary& s, const std::optional<RemoteCounters>& network,
                       const NavigateArguments& a) {
  const auto line = [&out](const std::string& what, const std::string& value) {
    out << "  " << what << std::string(what.size() < 22 ? 22 - what.size() : 1, ' ') << value << '\n';
  };
  out << "cell " << escaped(s.cell) << ", route " << escaped(a.route) << ", method " << a.method << ": "
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
  for (const std::string_view kind : {"replay:", "falcon:"})
    if (a.device.starts_with(kind)) inputs.push_back({"--device", a.device.substr(kind.size())});
  std::vector<NamedPath> outputs{
      {"--csv", a.csv}, {"--record", a.record}, {"--plot", a.plot}, {"--picture", a.picture}};
  if (a.realtime) outputs.push_back({"--fault-csv", faultCsvOf(a)});
  if (a.json) outputs.push_back({"--json", "-"});
  checkOutputs(inputs, outputs);
}

int runNavigate(const NavigateArguments& a) {
  checkPaths(a);
  bool in_memory = false;
  const std::unique_ptr<TileStore> store = openScene(a, in_memory);
  RunOptions options = optionsOf(a, *store, in_memory);

  std::optional<Output> csv;
  if (!a.csv.empty()) {
    csv.emplace(a.csv, OutputOptions{.cancel = &interruptFlag()});
    writeCsvHeader(csv->stream());
  }
  const bool takes_stdout =
      isStandardOutput(a.csv) || isStandardOutput(a.record) || isStandardOutput(a.plot) || isStandardOutput(a.picture);
  std::unique_ptr<TravelReport> travel;
  if (!a.plot.empty() || !a.picture.empty()) travel = std::make_unique<TravelReport>();
  CellNames cell_names(*store);
  Progress progress({.title = "navigate", .noun = "ticks"});

  if (options.realtime) holdForcesOnSignals();
  RunSummary summary;
  {
    EndingWatch watch = watchForSilentFiles();  // for the run alone: drawing and writing may take longer
    options.ending = [&watch] { watch.begin(); };
    summary = run(*store, options, [&](const TickRow& row) {
      if (csv) writeCsvRow(csv->stream(), row, cell_names.of(row.segment.cell));
      if (travel) travel->add(row);
      progress.update(row.tick);
    });
  }
  progress.finish();
  const bool interrupted = summary.outcome == RunOutcome::interrupted;
  // Rows are already gone through a pipe or a device. A file stays unchanged.
  if (csv && (!interrupted || !csv->isFile())) csv->finish();
  const std::string title = summary.cell + ", " + a.route + ", " + a.method;
  if (!a.plot.empty() && !interrupted) travel->writeForcePlot(a.plot, escaped(title), summary);
  std::string not_drawn;  // the travel and the other files stay where there is no OpenGL
  try {
    if (!a.picture.empty() && !interrupted) travel->writePicture(a.picture, escaped(title), summary, *store);
  } catch (const GraphicsError& error) {
    not_drawn = error.what();
  }

  const auto* const set = dynamic_cast<const TileSet*>(store.get());
  const std::optional<RemoteCounters> network = set != nullptr ? set->remoteCounters() : std::nullopt;
  if (a.json)
    std::cout << summaryJson(summary, network).dump(1, ' ', true, nlohmann::json::error_handler_t::replace) << '\n';
  else
    describeForPeople(takes_stdout ? std::cerr : std::cout, summary, network, a);
  for (const std::string& note : summary.notes) std::cerr << "filiform: note: " << note << '\n';
  if (interrupted && ((csv && csv->isFile()) || travel))
    std::cerr << "filiform: note: interrupted: the files of --csv, --plot and --picture were not written\n";
  for (const std::string& failure : summary.failures) std::cerr << "filiform: " << failure << '\n';
  if (!not_drawn.empty()) std::cerr << "filiform: --picture " << inShort(a.picture) << ": " << not_drawn << '\n';
  if (interrupted) return interruptedExitCode();
  if (!not_drawn.empty()) return 3;
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
      ->type_name("UM");
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
      tellAgain(*command, a->device);
      a->as_options = toldOptions(*command);
      return runNavigate(*a);
    };
  });
}

}  // namespace filiform::tools
