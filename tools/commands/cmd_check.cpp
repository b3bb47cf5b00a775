// filiform check: reads input as ingest does, and reports what ingest would keep, drop and refuse.
#include "index/anatomy/input_anatomy.h"
#include "index/cell/soma.h"
#include "index/circuits/circuit.h"
#include "index/errors.h"
#include "index/input/input.h"
#include "index/output.h"
#include "index/ranks/rank_inputs.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/anatomy_report.h"
#include "tools/commands/shared/check_page.h"
#include "tools/commands/shared/input_report_json.h"
#include "tools/commands/shared/reading_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/making/circuit_text.h"
#include "tools/words/numbers.h"
#include "tools/words/open_json.h"
#include "tools/words/unit.h"

#include <algorithm>
#include <functional>
#include <iostream>
#include <map>
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
  std::string unit = "um", report, profile = "standard";
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

constexpr std::size_t kNamedFiles = 20, kLinesOfACode = 3;
constexpr std::uint64_t kRecordsForLines = 10000;  // the first ones of an input

// The codes of an input with their first lines: "W_CYCLE line 2; W_ORDER lines 3, 5, 9 and 4 more".
std::string codesWithLines(const InputReport& report) {
  std::map<InputCode, std::vector<std::uint64_t>> lines;
  std::uint64_t seen = 0;
  for (auto record = report.records.begin(); record != report.records.end() && seen < kRecordsForLines;
       ++record, ++seen) {
    std::vector<std::uint64_t>& of_code = lines[record->code];
    if (record->line > 0 && of_code.size() < kLinesOfACode) of_code.push_back(record->line);
  }
  std::string text;
  for (const auto& [code, count] : report.codes.all()) {
    const std::vector<std::uint64_t>& named = lines[code];
    text += (text.empty() ? "" : "; ") + std::string(name(code));
    for (std::size_t i = 0; i < named.size(); ++i)
      text += (i > 0 ? ", " : count > 1 ? " lines " : " line ") + std::to_string(named[i]);
    if (named.empty() && count > 1) text += " " + formatCount(count) + " times";
    if (!named.empty() && count > named.size()) text += " and " + formatCount(count - named.size()) + " more";
  }
  return text;
}

// A line for each input with warnings.
std::string warnedText(const std::vector<SourceReport>& reports) {
  std::string text;
  std::size_t named = 0;
  forEachInput(reports, [&](const std::string& input, const InputReport& report, const InputOutcome& outcome) {
    if (outcome.fate == InputFate::kWarned && ++named <= kNamedFiles)
      text += "  warned " + inShort(input) + ": " + codesWithLines(report) + "\n";
  });
  if (named > kNamedFiles)
    text += "  and " + formatCount(named - kNamedFiles) + " more warned; --tsv and --report list them\n";
  return text;
}

std::string notesText(const CheckNotes& notes) {
  const std::vector<std::string>& off = notes.soma_three_point_off;
  if (off.empty()) return {};
  return "  soma_three_point_off " + formatCount(off.size()) +
         ": three soma samples, the outer two not one radius from the centre; kept as three samples (the first: " +
         inShort(off.front()) + ")\n";
}

void writeCheckJson(std::ostream& out, const std::vector<SourceReport>& reports, const CheckNotes& notes,
                    const InputAnatomy& anatomy, const FindingsBySource& findings) {
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
                   {"populations", populationsJson(notes.populations)},
                   {"anatomy", anatomyCountsJson(anatomy)}},
                  0);
  object.beginList("files");
  for (const SourceReport& row : reports) {
    object.beginElement();
    writeSourceJson(out, row, 2, {.findings = &findings});
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
  options.swc.strict = a.strict || a.profile == "strict";
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
  const bool is_page = endsWithNoCase(a.report, ".html");
  if (is_page && ranks != nullptr) throw UsageError("--report FILE.html: use filiform check, without ranks");
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
  InputAnatomy anatomy;
  CellPictures pictures;
  for (Cell cell; input.next(cell);) {
    if (!somataOf(cell).off_roots.empty()) notes.soma_three_point_off.push_back(cell.source);
    const std::vector<Finding>& findings = anatomy.add(cell);
    if (is_page) pictures.add(cell, findings);
  }
  if (parts) {
    parts->gather(nullptr);
    notes.soma_three_point_off = gathered(*ranks, notes.soma_three_point_off);
    const std::vector<Ranks::Bytes> findings = toFirst(*ranks, anatomy.encode());
    if (ranks->rank() != 0) return 0;
    for (std::size_t rank = 1; rank < findings.size(); ++rank) anatomy.take(findings[rank]);
  }
  anatomy.finish();
  progress.finish();
  std::vector<SourceReport> reports = reportsOf(input, circuit ? &*circuit : nullptr);
  if (circuit) notes.populations = circuit->populationsOf(reports);
  const FindingsBySource findings(anatomy.cells());
  if (a.profile == "strict") refuseDoubtful(reports, findings);
  notes.unit_doubt = input.unitDoubt();
  if (report) {
    if (is_page)
      writeCheckPage(report->stream(), summary(reports), reports, anatomy, pictures);
    else
      writeReportJson(report->stream(), reports, {.findings = &findings});
    report->finish();
  }
  if (a.json)
    writeCheckJson(people, reports, notes, anatomy, findings);
  else if (a.tsv)
    writeCheckTable(people, reports);
  else
    people << summary(reports) << warnedText(reports) << anatomyText(anatomy) << notesText(notes)
           << describePopulations(notes.populations);
  if (!notes.unit_doubt.empty()) std::cerr << "filiform: note: " << notes.unit_doubt << '\n';
  if (circuit)
    for (const std::string& doubt : circuit->doubts()) std::cerr << "filiform: note: " << doubt << '\n';
  if (a.profile != "lenient") return anyRefused(reports) ? 1 : 0;
  const InputTotals all = totals(reports);
  return all.accepted + all.warned == 0 ? 1 : 0;
}

using CheckRun = std::function<int(const CheckArguments& a)>;

void addCheckThat(CLI::App& app, Chosen& chosen, const CheckRun& run) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command = app.add_subcommand("check", "Read input as ingest does, and report what is wrong with it");
  command->footer(
      "Examples:\n  filiform check archive.zip more/ --tsv\n  filiform check more/ --report check.html\n"
      "  filiform check circuit_config.json\n"
      "Exits 1 if any input is refused. Doubts and notes say what is odd about the anatomy of cells; without --profile "
      "strict they refuse nothing.");
  command->add_option("INPUT", arguments->inputs, kInputHelp)->required();
  CLI::Option* const tsv = command->add_flag("--tsv", arguments->tsv,
                                             "write one row an input: file severity samples segments dropped codes");
  command->add_flag("--json", arguments->json, "write one object: the verdict, counts, and each file with its records")
      ->excludes(tsv);
  command
      ->add_option("--report", arguments->report,
                   "write a JSON record of everything dropped, cut or remarked, as ingest does, with doubts and notes; "
                   "FILE.html: a page with a picture of each cell, worst first")
      ->type_name("FILE");
  command->add_option("--unit", arguments->unit, kUnitHelp)->capture_default_str();
  addCircuitArguments(*command, arguments->circuit, arguments->no_soma_links);
  command->add_flag("--strict", arguments->strict, "refuse every file that has a warning");
  command
      ->add_option(
          "--profile", arguments->profile,
          "exit with 1: lenient, if no input can be used; standard, if one is refused; strict, as standard, and "
          "refuse inputs with a warning or a doubt")
      ->check(CLI::IsMember({"lenient", "standard", "strict"}))
      ->capture_default_str();
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
