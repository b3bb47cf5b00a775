// filiform ingest: makes a tile set from SWC files, folders and archives.
#include "index/circuits/circuit.h"
#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/ingest/ingest.h"
#include "index/input/input.h"
#include "index/output.h"
#include "index/remote/http_source.h"
#include "index/subsets/set_cells.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/cell_choice.h"
#include "tools/commands/shared/growth_report.h"
#include "tools/commands/shared/ingest_progress.h"
#include "tools/commands/shared/input_report_json.h"
#include "tools/commands/shared/reading_arguments.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress_option.h"
#include "tools/words/answer.h"
#include "tools/words/making/making.h"
#include "tools/words/numbers.h"
#include "tools/words/unit.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>
#include <sstream>
#include <utility>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct IngestArguments {
  std::vector<std::string> inputs, removed, cells, types;
  std::string out, unit = "um", quantum = "2^-9", memory = "1GiB", report, placements, attributes, key;
  std::uint32_t capacity = PartitionOptions{}.capacity;
  unsigned threads = 0;
  double log_s = 0;
  CircuitOptions circuit;
  bool no_soma_links = false, one_cell_a_file = false;
  bool apply_offset = false, strict = false, force = false, add = false, no_levels = false;
  bool sync = false, remove_gone = false, json = false;
  std::shared_ptr<ReadingArguments> reading;
  const CLI::App* command = nullptr;

  CellChoice choice() const { return {cells, reading->where, reading->box, types}; }
  bool isGiven(const char* option) const { return command->count(option) > 0; }
};

int quantumExponentOf(const std::string& text) {
  double quantum = 0;
  if (text.starts_with("2^"))
    quantum = std::exp2(parseNumber("--quantum", text.substr(2)));
  else
    quantum = parseNumber("--quantum", text);
  int exponent = 0;
  const double fraction = std::frexp(quantum, &exponent);
  --exponent;  // quantum = 2 fraction * 2^exponent
  if (fraction != 0.5 || exponent < Grid::kMinExponent || exponent > Grid::kMaxExponent)
    throw UsageError("--quantum " + inShort(text) + ": give a power of two from 2^" +
                     std::to_string(Grid::kMinExponent) + " to 2^" + std::to_string(Grid::kMaxExponent) +
                     " um, such as 2^-9");
  return exponent;
}

IngestOptions ingestOptionsOf(const IngestArguments& a) {
  IngestOptions options;
  options.capacity = a.capacity;
  options.quantum_exponent = quantumExponentOf(a.quantum);
  options.threads = a.threads;
  options.levels = !a.no_levels;
  options.force = a.force;
  options.cancel = &interruptFlag();
  options.memory = parseBytes("--memory", a.memory);
  if (options.memory < kMinIngestMemory)
    throw UsageError("--memory " + inShort(a.memory) + ": give at least " + formatBytes(kMinIngestMemory));
  return options;
}

MakingOrder orderOf(const IngestArguments& a) {
  MakingOrder order{.inputs = a.inputs, .output = a.out};
  order.reading.swc = {.apply_offset = a.apply_offset, .strict = a.strict};
  order.reading.swc.soma_links = !a.no_soma_links;
  readUnit(a.unit, order.reading.swc);
  order.reading.one_cell_a_file = a.one_cell_a_file;
  a.reading->apply(order.reading);
  order.circuit = a.circuit;
  order.placements.path = a.placements;
  order.attributes.path = a.attributes;
  order.key = a.key;
  order.add = a.add;
  order.sync = a.sync;
  order.remove_gone = a.remove_gone;
  order.remove = a.removed;
  return order;
}

// True for the folder of a tile set, and for an address of one, by its form.
bool isSet(const std::string& input) {
  std::error_code error;
  if (!isAddress(input)) return std::filesystem::is_regular_file(input + "/CURRENT", error);
  std::string name = input;
  while (name.ends_with('/')) name.pop_back();
  return endsWithNoCase(name, ".fil") || name.find("/v1/sets/") != std::string::npos;
}

// Makes a set of cells of another, or adds them to one.
int runFromSet(const IngestArguments& a, IngestOptions options) {
  const std::string& from = a.inputs.front();
  if (a.inputs.size() > 1)
    throw UsageError("INPUT " + inShort(from) + " is a tile set; give it alone, or make several sets one with --add");
  for (const char* const option :
       {"--placements", "--attributes", "--unit", "--apply-offset", "--version", "--ids", "--one-cell-a-file",
        "--strict", "--sync", "--report", "--population", "--morphologies", "--no-soma-links"})
    if (a.isGiven(option))
      throw UsageError(std::string(option) + " is for files of neurons; INPUT " + inShort(from) + " is a tile set");
  std::error_code error;
  if (std::filesystem::equivalent(from, a.out, error))
    throw UsageError("INPUT and --output are the same tile set " + inShort(from));
  const auto set = TileSet::open(from, a.reading->remote->options());
  if (!a.isGiven("--capacity")) options.capacity = set->capacity();
  if (!a.isGiven("--quantum")) options.quantum_exponent = set->grid().exponent();
  const unsigned threads = threadsOr(a.threads);
  options.reading_bytes = options.memory / 4;
  SetCells cells(*set, a.choice().select(*set, threads),
                 {.types = a.choice().sampleTypes(),
                  .memory_bytes = options.reading_bytes,
                  .threads = threads,
                  .check = throwIfInterrupted});
  options.provenance = [&] { return cells.provenance(); };
  IngestProgress progress(a.log_s);
  options.progress = [&](const char* phase, std::uint64_t done, std::uint64_t total) {
    progress.build(phase, done, total);
  };
  GrowthResult result;
  if (a.add)
    result = addCells(cells, a.out, options);
  else
    result.set = ingest(cells, a.out, options);
  progress.end();
  std::cout << (a.json  ? jsonText(ingestJson(result.set, {}, nullptr)) + "\n"
                : a.add ? reportOf(a.out, result)
                        : reportOf(a.out, result.set));
  return 0;
}

// Growing a set is the work of one process.
void checkTogether(const IngestArguments& a) {
  if (a.add || a.sync || !a.removed.empty())
    throw UsageError("--add, --sync and --remove: use filiform ingest, without ranks");
}

// `ranks`: processes that make the set together, or null.
int runIngest(const IngestArguments& a, Ranks* ranks) {
  refuseAddress("--output", a.out);
  IngestOptions options = ingestOptionsOf(a);
  MakingOrder order = orderOf(a);
  checkOrder(order, a.force);
  if (ranks != nullptr) checkTogether(a);
  if (std::any_of(a.inputs.begin(), a.inputs.end(), isSet)) {
    if (ranks != nullptr) throw UsageError("a tile set as INPUT: use filiform ingest, without ranks");
    return runFromSet(a, std::move(options));
  }
  if (!a.cells.empty() || !a.types.empty())
    throw UsageError("--cell and --type choose from a tile set; no INPUT is one");
  IngestProgress progress(a.log_s);
  const auto ofAll = [ranks](std::string_view step, std::uint64_t done, std::uint64_t total) {
    return ranks != nullptr ? ranks->progress(step, {done, total}) : Ranks::Amount{done, total};
  };
  order.reading.progress = [&](std::uint64_t done, std::uint64_t total) {
    if (a.sync) throwIfInterrupted();
    const Ranks::Amount all = ofAll("bytes", done, total);
    progress.read(all.done, all.total);
  };
  std::vector<NamedPath> inputs{{"--placements", a.placements}, {"--attributes", a.attributes}};
  if (!a.reading->ids.empty()) inputs.push_back({"--ids", a.reading->ids});
  for (const std::string& path : a.inputs)
    if (!isAddress(path)) inputs.push_back({"INPUT", path});
  checkOutputs(inputs, {{"--report", a.report}, {"--json", a.json ? "-" : ""}});
  std::optional<Output> report;
  const bool is_first = ranks == nullptr || ranks->rank() == 0;
  if (!a.report.empty() && is_first) report.emplace(a.report, OutputOptions{.cancel = &interruptFlag()});
  std::ostringstream untold;  // --json says it
  std::ostream& people = a.json ? untold : report && report->isStandardOutput() ? std::cerr : std::cout;
  order.report = [&](const std::vector<SourceReport>& reports, const SyncFates* fates) {
    if (!report) return;
    writeReportJson(report->stream(), reports, {.fates = fates});
    report->finish();
  };
  order.ended_reading = [&] { progress.endReading(); };
  options.ranks = ranks;
  options.progress = [&](const char* phase, std::uint64_t done, std::uint64_t total) {
    const Ranks::Amount all = ofAll(phase, done, total);
    progress.build(phase, all.done, all.total);
  };
  const bool removes = !order.remove.empty();
  const MakingResult made = make(std::move(order), std::move(options));
  if (!is_first) return 0;
  progress.end();
  people << made.text;
  for (const std::string& note : made.notes) std::cerr << "filiform: note: " << note << '\n';
  people << (a.sync             ? reportOf(a.out, made)
             : a.add || removes ? reportOf(a.out, static_cast<const GrowthResult&>(made))
                                : reportOf(a.out, made.set));
  if (a.json) std::cout << jsonText(ingestJson(made.set, made.reports, a.sync ? &made.counts : nullptr)) << '\n';
  return 0;
}

using Run = std::function<int(const IngestArguments& a)>;

void addIngestThat(CLI::App& app, Chosen& chosen, const Run& run) {
  auto a = std::make_shared<IngestArguments>();
  CLI::App* command = app.add_subcommand("ingest", "Make a tile set from files of neurons, folders and archives");
  a->command = command;
  command->footer(
      "Examples:\n  filiform ingest archive.zip more/*.swc -o column.fil\n"
      "  filiform ingest library.zip --placements column.tsv -o column.fil\n"
      "  filiform ingest circuit_config.json -o circuit.fil\n"
      "  filiform ingest nodes.h5 --morphologies merged-morphologies.h5 -o circuit.fil\n"
      "  filiform ingest --add more.zip -o column.fil\n"
      "  filiform ingest --sync folder -o my.fil\n"
      "  filiform ingest --remove CELL -o my.fil\n"
      "  filiform ingest column.fil --where 'measure:length>1000' --type axon -o part.fil\n"
      "Files that cannot be used are counted and named; the others are ingested. filiform check lists them "
      "beforehand.\n"
      "A tile set as INPUT gives a set of its cells, or of those that --cell, --where and --box choose.");
  command->add_option("INPUT", a->inputs, std::string(kInputHelp) + "; or one tile set");
  command->add_option("-o,--output", a->out, "write the tile set to this folder")->required()->type_name("SET");
  command->add_option("--capacity", a->capacity, "put at most N segments in a tile")
      ->capture_default_str()
      ->check(CLI::Range(1u, 1u << 30));
  command->add_option("--quantum", a->quantum, "round positions to this grid, um: a power of two")
      ->capture_default_str();
  command->add_option("--unit", a->unit, kUnitHelp)->capture_default_str();
  a->reading = addReadingArguments(*command, true);
  addCellAndType(*command, a->cells, a->types, "of a tile set, read");
  command->add_flag("--apply-offset", a->apply_offset, "add the '# OFFSET' of each header to its positions");
  command
      ->add_option("--memory", a->memory,
                   "use at most this memory and 32MiB; at least 64MiB (K, M, G: KiB, MiB, GiB); larger input "
                   "goes through a file beside the set")
      ->capture_default_str()
      ->type_name("BYTES");
  command->add_option("--threads", a->threads, "use N threads; 0: one a core")->capture_default_str();
  command->add_option("--placements", a->placements, "place cells as this table says; the input is then a library")
      ->type_name("TSV");
  command->add_option("--attributes", a->attributes, "keep the attributes of cells in this CSV or TSV table")
      ->type_name("TABLE");
  command->add_option("--key", a->key, "the column of --attributes that holds the names of cells, as neuron_name")
      ->type_name("COLUMN");
  addCircuitArguments(*command, a->circuit, a->no_soma_links);
  command->add_flag("--one-cell-a-file", a->one_cell_a_file,
                    "keep a file that holds several cells as one; otherwise they become FILE/1, FILE/2, and trees "
                    "without a soma FILE/loose");
  command->add_flag("--no-levels", a->no_levels,
                    "write no levels of detail: faster and smaller, but pictures of large sets lack neurites");
  command->add_flag("--strict", a->strict, "refuse files that have a warning; write nothing if a file is refused");
  command->add_flag("--add", a->add, "add the cells to the set; its --capacity and --quantum stay");
  command->add_option("--remove", a->removed, "remove the cell of this name from the set; repeatable")
      ->type_name("CELL")
      ->allow_extra_args(false);
  command->add_flag("--sync", a->sync,
                    "make the set follow its input: add new cells, replace changed ones, keep equal ones");
  command->add_flag("--delete", a->remove_gone, "with --sync: remove the cells that are no longer in the input");
  command->add_flag("--force", a->force, "replace an existing set");
  command->add_flag("--json", a->json, "write one JSON object instead of text");
  command
      ->add_option("--log", a->log_s,
                   "write a line about the progress every N seconds to standard error, and how long each step took")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command->add_option("--report", a->report, "write a JSON record of everything dropped, cut or remarked")
      ->type_name("FILE");
  addProgressOption(*command);
  command->callback([a, &chosen, run] { chosen = [a, run] { return run(*a); }; });
}

}  // namespace

void addIngest(CLI::App& app, Chosen& chosen) {
  addIngestThat(app, chosen, [](const IngestArguments& a) { return runIngest(a, nullptr); });
}

void addIngestTogether(CLI::App& app, Chosen& chosen, Ranks& ranks, const Around& around) {
  addIngestThat(app, chosen, [&ranks, around](const IngestArguments& a) {
    return around([&] { return runIngest(a, ranks.count() > 1 ? &ranks : nullptr); });
  });
}

}  // namespace filiform::tools
