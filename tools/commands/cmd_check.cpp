// filiform check: reads input as ingest does, and reports what ingest would keep, drop and refuse.
#include "index/cell/soma.h"
#include "index/circuits/circuit.h"
#include "index/errors.h"
#include "index/input/input.h"
#include "index/output.h"
#include "index/ranks/rank_inputs.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/circuit_report.h"
#include "tools/commands/shared/input_report_json.h"
#include "tools/commands/shared/reading_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/numbers.h"
#include "tools/words/open_json.h"
#include "tools/words/unit.h"

#include <algorithm>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using Json = nlohmann::ordered_json;

struct CheckArguments {
  std::vector<std::string> inputs;
  std::string unit = "um", report;
  CircuitOptions circuit;
  bool tsv = false, json = false, strict = false, no_soma_links = false;
  std::shared_ptr<ReadingArguments> reading;
};

// Remarks that have no column in the TSV.
struct CheckNotes {
  std::string unit_doubt;
  std::vector<std::string> soma_three_point_off;  // sources of the cells
  std::vector<PopulationReport> populations;      // of a circuit
};

Json populationsJson(const std::vector<PopulationReport>& populations) {
  Json list = Json::array();
  for (const PopulationReport& p : populations)
    list.push_back({{"file", p.file},
                    {"population", p.name},
                    {"type", p.type},
                    {"nodes", p.nodes},
                    {"placed", p.placed},
                    {"missing", p.missing},
                    {"without_morphology", p.without},
                    {"mean_y", {p.mean_y.x(), p.mean_y.y(), p.mean_y.z()}},
                    {"attributes_left_out", p.skipped},
                    {"refused", p.refused}});
  return list;
}

std::string notesText(const CheckNotes& notes) {
  const std::vector<std::string>& off = notes.soma_three_point_off;
  if (off.empty()) return {};
  return "  soma_three_point_off " + formatCount(off.size()) +
         ": three soma samples, the outer two not one radius from the centre; kept as three samples (the first: " +
         inShort(off.front()) + ")\n";
}

void writeCheckJson(std::ostream& out, const std::vector<SourceReport>& reports, const CheckNotes& notes) {
  const InputTotals all = totals(reports);
  OpenJson object(out,
                  {{"verdict", std::string(name(verdict(reports)))},
                   {"inputs", all.inputs()},
                   {"accepted", all.accepted},
                   {"warned", all.warned},
                   {"skipped", all.skipped},
                   {"refused", all.refused},
                   {"passed_over", all.passed_over},
                   {"bytes", all.bytes},
                   {"samples", all.samples},
                   {"segments", all.segments},
                   {"codes", countsJson(all.codes)},
                   {"unit_doubt", notes.unit_doubt},
                   {"soma_three_point_off", notes.soma_three_point_off},
                   {"populations", populationsJson(notes.populations)}},
                  0);
  object.beginList("files");
  for (const SourceReport& row : reports) {
    object.beginElement();
    writeSourceJson(out, row, 2);
  }
  object.endList();
  object.end();
  out << '\n';
}

// Rank 0 gets the sources of all ranks, in the order of cells.
std::vector<std::string> gathered(Ranks& ranks, const std::vector<std::string>& sources) {
  std::vector<std::string> all;
  for (const Ranks::Bytes& bytes : toFirst(ranks, Json::to_cbor(sources)))
    if (!bytes.empty())
      for (const Json& source : Json::from_cbor(bytes)) all.push_back(source.get<std::string>());
  return all;
}

// `ranks`: processes that check together, or null. Rank 0 writes.
int runCheck(const CheckArguments& a, Ranks* ranks) {
  Progress progress({.title = "check", .noun = "", .unit = ProgressUnit::bytes});
  InputOptions options;
  options.swc.strict = a.strict;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  readUnit(a.unit, options.swc);
  a.reading->apply(options);
  options.progress = [&](std::uint64_t done, std::uint64_t total) {
    throwIfInterrupted();
    const Ranks::Amount all = ranks != nullptr ? ranks->progress("bytes", {done, total}) : Ranks::Amount{done, total};
    progress.setTotal(all.total);
    progress.update(all.done);
  };
  options.swc.soma_links = !a.no_soma_links;
  refuseSeveralCircuits(a.inputs);
  std::optional<Output> report;
  if (!a.report.empty()) {
    std::vector<NamedPath> inputs;
    for (const std::string& path : a.inputs)
      if (!isAddress(path)) inputs.push_back({"INPUT", path});
    checkOutputs(inputs, {{"--report", a.report}});
    if (ranks == nullptr || ranks->rank() == 0) report.emplace(a.report, OutputOptions{.cancel = &interruptFlag()});
  }
  std::ostream& people = report && report->isStandardOutput() ? std::cerr : std::cout;
  std::optional<Circuit> circuit;
  if (Circuit::isCircuit(a.inputs, a.circuit))
    circuit.emplace(Circuit::read(a.inputs.front(), a.circuit));
  else if (!a.circuit.population.empty() || !a.circuit.morphologies.empty())
    throw UsageError("--population and --morphologies are for one circuit_config.json or one nodes.h5");
  Input input = circuit ? Input(circuit->files(), options) : Input(a.inputs, options);
  std::optional<RankInputs> parts;
  if (ranks != nullptr) parts.emplace(*ranks, input, nullptr, nullptr);
  CheckNotes notes;
  for (Cell cell; input.next(cell);)
    if (!somataOf(cell).off_roots.empty()) notes.soma_three_point_off.push_back(cell.source);
  if (parts) {
    parts->gather(nullptr);
    notes.soma_three_point_off = gathered(*ranks, notes.soma_three_point_off);
    if (ranks->rank() != 0) return 0;
  }
  progress.finish();
  const std::vector<SourceReport> reports = reportsOf(input, circuit ? &*circuit : nullptr);
  if (circuit) notes.populations = circuit->populationsOf(reports);
  notes.unit_doubt = input.unitDoubt();
  if (report) {
    writeReportJson(report->stream(), reports);
    report->finish();
  }
  if (a.json)
    writeCheckJson(people, reports, notes);
  else if (a.tsv)
    writeCheckTable(people, reports);
  else
    people << summary(reports) << notesText(notes) << describePopulations(notes.populations);
  if (!notes.unit_doubt.empty()) std::cerr << "filiform: note: " << notes.unit_doubt << '\n';
  if (circuit)
    for (const std::string& doubt : circuit->doubts()) std::cerr << "filiform: note: " << doubt << '\n';
  return anyRefused(reports) ? 1 : 0;
}

using CheckRun = std::function<int(const CheckArguments& a)>;

void addCheckThat(CLI::App& app, Chosen& chosen, const CheckRun& run) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command = app.add_subcommand("check", "Read input as ingest does, and report what is wrong with it");
  command->footer(
      "Examples:\n  filiform check archive.zip more/ --tsv\n  filiform check circuit_config.json\nExits 1 if any input "
      "is refused.");
  command->add_option("INPUT", arguments->inputs, kInputHelp)->required();
  CLI::Option* const tsv = command->add_flag("--tsv", arguments->tsv,
                                             "write one row an input: file severity samples segments dropped codes");
  command->add_flag("--json", arguments->json, "write one object: the verdict, counts, and each file with its records")
      ->excludes(tsv);
  command
      ->add_option("--report", arguments->report,
                   "write a JSON record of everything dropped, cut or remarked, as ingest does")
      ->type_name("FILE");
  command->add_option("--unit", arguments->unit, kUnitHelp)->capture_default_str();
  addCircuitArguments(*command, arguments->circuit, arguments->no_soma_links);
  command->add_flag("--strict", arguments->strict, "refuse every file that has a warning");
  arguments->reading = addReadingArguments(*command);
  addProgressOption(*command);
  command->callback([arguments, &chosen, run] { chosen = [arguments, run] { return run(*arguments); }; });
}

}  // namespace

void addCheck(CLI::App& app, Chosen& chosen) {
  addCheckThat(app, chosen, [](const CheckArguments& a) { return runCheck(a, nullptr); });
}

void addCheckTogether(CLI::App& app, Chosen& chosen, Ranks& ranks, const Around& around) {
  addCheckThat(app, chosen, [&ranks, around](const CheckArguments& a) {
    return around([&] { return runCheck(a, ranks.count() > 1 ? &ranks : nullptr); });
  });
}

}  // namespace filiform::tools
