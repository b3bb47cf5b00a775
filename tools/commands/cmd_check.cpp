// filiform check: reads input as ingest does, and reports what ingest would keep, drop and refuse.
#include "index/cell/soma.h"
#include "index/input/input.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/program/interruption.h"
#include "tools/program/numbers.h"
#include "tools/program/open_json.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/program/unit.h"

#include <algorithm>
#include <iostream>
#include <thread>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using Json = nlohmann::ordered_json;

struct CheckArguments {
  std::vector<std::string> inputs;
  std::string unit = "um";
  bool tsv = false, json = false, strict = false;
};

Json countsOf(const CodeCounts& codes) {
  Json counts = Json::object();
  for (const auto& [code, count] : codes.all()) counts[std::string(name(code))] = count;
  return counts;
}

// Remarks that have no column in the TSV.
struct CheckNotes {
  std::string unit_doubt;
  std::vector<std::string> soma_three_point_off;  // sources of the cells
};

std::string textOf(const CheckNotes& notes) {
  const std::vector<std::string>& off = notes.soma_three_point_off;
  if (off.empty()) return {};
  return "  soma_three_point_off " + formatCount(off.size()) +
         ": three soma samples, the outer two not one radius from the centre; kept as three samples (the first: " +
         escaped(off.front()) + ")\n";
}

void writeCheckJson(std::ostream& out, const std::vector<SourceReport>& reports, const CheckNotes& notes) {
  const InputTotals all = totals(reports);
  OpenJson object(out,
                  {{"verdict", std::string(name(verdict(reports)))},
                   {"inputs", all.accepted + all.warned + all.skipped + all.refused},
                   {"accepted", all.accepted},
                   {"warned", all.warned},
                   {"skipped", all.skipped},
                   {"refused", all.refused},
                   {"bytes", all.bytes},
                   {"samples", all.samples},
                   {"segments", all.segments},
                   {"codes", countsOf(all.codes)},
                   {"unit_doubt", notes.unit_doubt},
                   {"soma_three_point_off", notes.soma_three_point_off}},
                  0);
  object.beginList("files");
  for (const SourceReport& row : reports) {
    object.beginElement();
    OpenJson file(out,
                  {{"file", row.file},
                   {"severity", std::string(name(row.report.severity))},
                   {"samples", row.report.samples},
                   {"segments", row.report.segments}},
                  2);
    file.beginText("dropped");
    if (anyDropped(row))
      writeDropped(row, [&](std::string_view piece) { file.addText(piece); });
    else
      file.addText("-");
    file.endText();
    file.member("codes", countsOf(row.report.codes));
    file.end();
  }
  object.endList();
  object.end();
  out << '\n';
}

int runCheck(const CheckArguments& a) {
  Progress progress({.title = "check", .noun = "", .unit = ProgressUnit::bytes});
  InputOptions options;
  options.swc.strict = a.strict;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  readUnit(a.unit, options.swc);
  options.progress = [&](std::uint64_t done, std::uint64_t total) {
    throwIfInterrupted();
    progress.setTotal(total);
    progress.update(done);
  };
  Input input(a.inputs, options);
  CheckNotes notes;
  for (Cell cell; input.next(cell);)
    if (!somataOf(cell).off_roots.empty()) notes.soma_three_point_off.push_back(cell.source);
  progress.finish();
  notes.unit_doubt = input.unitDoubt();
  if (a.json)
    writeCheckJson(std::cout, input.reports(), notes);
  else if (a.tsv)
    writeCheckTable(std::cout, input.reports());
  else
    std::cout << summary(input.reports()) << textOf(notes);
  if (!notes.unit_doubt.empty()) std::cerr << "filiform: note: " << notes.unit_doubt << '\n';
  return anyRefused(input.reports()) ? 1 : 0;
}

}  // namespace

void addCheck(CLI::App& app, Chosen& chosen) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command = app.add_subcommand("check", "Read input as ingest does, and report what is wrong with it");
  command->footer("Example:\n  filiform check archive.zip more/ --tsv\nExits 1 if any input is refused.");
  command
      ->add_option("INPUT", arguments->inputs,
                   "SWC files, folders, zip archives; graphs: .edges, .obj, .vtk, skeletons")
      ->required();
  CLI::Option* const tsv = command->add_flag("--tsv", arguments->tsv,
                                             "write one row an input: file severity samples segments dropped codes");
  command
      ->add_flag("--json", arguments->json,
                 "write one object: the verdict, counts, and the fields of --tsv for each file")
      ->excludes(tsv);
  command->add_option("--unit", arguments->unit, kUnitHelp)->capture_default_str();
  command->add_flag("--strict", arguments->strict, "refuse every file that has a warning");
  addProgressOption(*command);
  command->callback([arguments, &chosen] { chosen = [arguments] { return runCheck(*arguments); }; });
}

}  // namespace filiform::tools
