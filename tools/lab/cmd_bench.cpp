// filiform bench: measures named workloads and writes the results.
#include "index/errors.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/lab/bench/bench.h"
#include "tools/lab/bench/bench_record.h"
#include "tools/lab/bench/peers.h"
#include "tools/lab/lab_commands.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct BenchCommand {
  BenchOptions options;
  std::vector<std::string> names;
  bool list = false, json = false, strict = false;
};

constexpr int kMissedExit = 5;

int listWorkloads(const std::vector<Workload>& all, bool as_json) {
  if (as_json) {
    nlohmann::ordered_json list{{"workloads", nlohmann::json::array()}};
    for (const Workload& workload : all)
      list["workloads"].push_back({{"name", workload.name}, {"summary", workload.summary}});
    for (const Peer& peer : peers())
      list["peers"][peer.name] = peer.inBuild() ? nlohmann::json(peer.version) : nlohmann::json();
    std::cout << list.dump(1, ' ', true) << '\n';
    return 0;
  }
  for (const Workload& workload : all)
    std::cout << workload.name
              << std::string(std::max<std::size_t>(14, workload.name.size() + 2) - workload.name.size(), ' ')
              << workload.summary << '\n';
  std::cout << "\npeers:";
  for (const Peer& peer : peers())
    std::cout << ' ' << peer.name << ' ' << (peer.inBuild() ? peer.version : std::string("(not in this build)"));
  std::cout << '\n';
  return 0;
}

// One line for each promise that was missed.
std::vector<std::string> missedPromises(const std::vector<BenchResult>& results) {
  std::vector<std::string> missed;
  for (const BenchResult& result : results) {
    for (const BenchGoal& goal : result.report.goals)
      if (!goal.met_must)
        missed.push_back(result.name + ": " + goal.what + ": " + shown(goal.measured) + ", promised " + goal.must);
    for (const BenchBound& bound : result.report.bounds)
      if (!bound.holds())
        missed.push_back(result.name + ": " + bound.what + ": " + shown(bound.measured) + ' ' + bound.unit +
                         ", stated bound " + shown(bound.bound));
  }
  return missed;
}

int runBench(BenchCommand command) {
  const std::vector<Workload> all = workloads();
  if (command.list) return listWorkloads(all, command.json);
  if (command.options.quick) command.options.corpus.clear();
  std::vector<Workload> chosen;
  for (const std::string& name : command.names) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Workload& w) { return w.name == name; });
    if (found == all.end()) {
      std::string names;
      for (const Workload& workload : all) names += (names.empty() ? "" : ", ") + workload.name;
      throw UsageError("no workload is called " + name + ": choose from " + names);
    }
    if (std::any_of(chosen.begin(), chosen.end(), [&](const Workload& w) { return w.name == name; }))
      throw UsageError("workload " + name + " is named twice: name each once");
    chosen.push_back(*found);
  }
  if (command.names.empty()) chosen = all;
  if (!command.options.scene.empty())
    TileSet::open(command.options.scene);  // fails before the work if this is not a tile set
  checkOutputFolder({{"--corpus", command.options.corpus}, {"--scene", command.options.scene}},
                    {"--output", command.options.out});
  std::error_code error;
  std::filesystem::create_directories(command.options.out, error);
  if (error) throw IoError(command.options.out, "cannot make the folder", error.value());
  using std::chrono::steady_clock;
  const auto started = steady_clock::now();
  const auto elapsed_s = [&] { return std::chrono::duration<double>(steady_clock::now() - started).count(); };
  double load = 0;
  getloadavg(&load, 1);
  const bool terminal = isatty(STDERR_FILENO) == 1;
  std::vector<BenchResult> results;
  for (const Workload& workload : chosen) {
    command.options.progress = [&](const std::string& what) {
      throwIfInterrupted();
      if (!terminal) return;
      std::cerr << "bench " << workload.name << " (" << results.size() + 1 << " of " << chosen.size() << ", "
                << std::lround(elapsed_s()) << " s): " << what << '\n';
    };
    results.push_back(runWorkload(workload, command.options));
    if (!command.json) std::cout << workloadMarkdown(results.back(), command.options) << std::endl;
    writeBenchRun(results, command.options, elapsed_s(), load);  // an interrupted run keeps the finished workloads
  }
  if (command.json) std::cout << benchRunJson(results, command.options, elapsed_s(), load);
  const std::vector<std::string> missed = missedPromises(results);
  if (!command.strict || missed.empty()) return 0;
  std::cerr << "filiform: bench: " << missed.size() << (missed.size() == 1 ? " promise is" : " promises are")
            << " missed, first " << escaped(missed.front() + "; " + command.options.out) << "/bench.md lists all\n";
  return kMissedExit;
}

}  // namespace

void addBench(CLI::App& app, Chosen& chosen) {
  auto command = std::make_shared<BenchCommand>();
  CLI::App* bench = app.add_subcommand("bench", "Measure named workloads, with ratios to peers in the same run");
  bench->footer(
      "Examples:\n  filiform bench --list\n  filiform bench solver --out bench\n"
      "  filiform bench extremes --strict   (exit 5: a promise is missed)");
  bench->add_option("NAME", command->names, "workloads to run; default: all");
  CLI::Option* list = bench->add_flag("--list", command->list, "list workloads and peers");
  bench->add_flag("--json", command->json, "print only JSON on stdout, instead of Markdown");
  CLI::Option* strict =
      bench->add_flag("--strict", command->strict, "exit with 5 if a promise is missed or a stated bound is exceeded");
  bench
      ->add_option("-o,--output,--out", command->options.out,
                   "write bench.json, .csv, .md and .html, NAME.json, NAME.md and pictures to this folder")
      ->capture_default_str();
  bench->add_option("--seed", command->options.seed, "random seed")->capture_default_str();
  bench->add_option("--corpus", command->options.corpus, "take cells from this folder of real reconstructions")
      ->envname("FILIFORM_CORPUS");
  bench->add_option("--size,--segments", command->options.segments,
                    "largest number of segments; 0: chosen by the workload");
  bench
      ->add_option("--scene,--set", command->options.scene,
                   "tile set for `cells`, `loop`, `scene` and `viewer`; default: a synthetic set")
      ->type_name("SET");
  bench->add_flag("--long", command->options.long_run, "run the largest sizes, and each loop for ten minutes: hours");
  bench->add_flag("--quick", command->options.quick, "run small sizes without the corpus, to see that it works");
  list->excludes(strict);
  bench->callback([command, &chosen] { chosen = [command] { return runBench(*command); }; });
}

}  // namespace filiform::tools
