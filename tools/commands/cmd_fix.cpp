// filiform fix: writes neurons as clean SWC files, with a record of each change.
#include "index/anatomy/repair.h"
#include "index/cell/cell_parts.h"
#include "index/circuits/circuit.h"
#include "index/errors.h"
#include "index/export/clean_swc.h"
#include "index/ingest/input_provenance.h"
#include "index/input/input.h"
#include "index/output.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/reading_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/making/circuit_text.h"
#include "tools/words/making/output_folder.h"
#include "tools/words/numbers.h"
#include "tools/words/unit.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

constexpr const char* kChanges = "changes.tsv";

struct FixArguments {
  std::vector<std::string> inputs;
  std::string out, unit = "um", report, gap, unknown_radius = "0";
  bool apply_offset = false, no_soma_links = false, drop_long_links = false, soma_links = false, force = false,
       one_cell_a_file = false;
  std::shared_ptr<ReadingArguments> reading;
};

RepairOptions repairOptionsOf(const FixArguments& a) {
  RepairOptions options;
  options.drop_long_links = a.drop_long_links;
  options.soma_links = a.soma_links;
  if (!a.gap.empty()) {
    options.join_gaps_um = parseNumber("--join-gaps", a.gap);
    if (!(options.join_gaps_um >= RepairOptions::kLeastGap_um && options.join_gaps_um <= RepairOptions::kMostGap_um))
      throw UsageError("--join-gaps " + inShort(a.gap) + ": give a distance from " +
                       formatNumber(RepairOptions::kLeastGap_um) + " to " + formatNumber(RepairOptions::kMostGap_um) +
                       " um");
  }
  options.unknown_radius_um = parseNumber("--unknown-radius", a.unknown_radius);
  if (!(options.unknown_radius_um >= 0 && options.unknown_radius_um <= Grid::kMaxCoordinate_um))
    throw UsageError("--unknown-radius " + inShort(a.unknown_radius) + ": give a radius in um, at least 0");
  return options;
}

// The rows of changes.tsv: source line sample change detail.
class ChangeTable {
 public:
  explicit ChangeTable(std::ostream& out) : out_(out) { out_ << "source\tline\tsample\tchange\tdetail\n"; }

  void row(const std::string& source, std::uint64_t line, const std::string& sample, std::string_view change,
           const std::string& detail) {
    out_ << escaped(source) << '\t' << (line > 0 ? std::to_string(line) : "-") << '\t'
         << (sample.empty() ? "-" : sample) << '\t' << change << '\t' << (detail.empty() ? "-" : detail) << '\n';
  }
  void repaired(const std::string& source, const RepairChange& change) {
    using Kind = RepairChange::Kind;
    const std::string other = std::to_string(change.other), um = formatNumber(change.value) + " um",
                      count = formatNumber(change.value);
    std::string detail;
    switch (change.kind) {
      case Kind::kLinkDropped:
        detail = "link to sample " + other + ", " + um;
        break;
      case Kind::kGapJoined:
      case Kind::kSomaLinked:
        detail = "parent is now sample " + other + ", " + um + " away";
        break;
      case Kind::kTurnedRound:
        detail = count + " links turned; the root of the tree is now sample " + other;
        break;
      case Kind::kRadiusSet:
        detail = "radius unknown; written as " + count;
        break;
      case Kind::kRenumbered:
        detail = "id repeats; written as " + other;
        break;
      case Kind::kParentsFirst:
        detail = "parents after their children: " + count + "; samples written behind their parents";
        break;
      case Kind::kHeaderCut:
        detail = "lines beyond 64 KiB of the header left out";
        break;
    }
    const bool of_cell = change.kind == Kind::kParentsFirst || change.kind == Kind::kHeaderCut;
    row(source, of_cell ? 0 : change.line, of_cell ? "" : std::to_string(change.sample), name(change.kind), detail);
  }
  // What reading dropped, cut or remarked. Remarks beyond the first ones of a code have no record; their count follows.
  void read(const std::string& source, const InputReport& report, bool offset_added) {
    CodeCounts listed;
    for (auto record = report.records.begin(); record != report.records.end(); ++record) {
      listed.add(record->code);
      const std::string_view effect = name(record->effect);
      row(source, record->line, "", name(record->code),
          std::string(effect) + ": " + std::string(explanation(record->code)) +
              (record->token.empty() ? "" : " (" + record->token + ")"));
    }
    for (const auto& [code, count] : report.codes.all())
      if (count > listed[code])
        row(source, 0, "", name(code), "and " + std::to_string(count - listed[code]) + " more without a line");
    if (offset_added && report.header.offset && *report.header.offset != Vector3d::Zero()) {
      const Vector3d& offset = *report.header.offset;
      row(source, 0, "", "offset_added",
          "the OFFSET of the header: " + formatNumber(offset.x()) + " " + formatNumber(offset.y()) + " " +
              formatNumber(offset.z()));
    }
    if (report.later_comments > 0)
      row(source, 0, "", "comments_left_out",
          std::to_string(report.later_comments) + " comment lines after the first sample");
  }

 private:
  std::ostream& out_;
};

// The cells that a reader would find in the repaired cell: a dropped link may have joined two. Adds the changes.
std::vector<Cell> repairedCells(Cell whole, const RepairOptions& repairs, bool one_cell_a_file,
                                std::vector<RepairChange>& changes) {
  std::vector<Cell> repaired, open;
  open.push_back(std::move(whole));
  while (!open.empty()) {
    Cell cell = std::move(open.back());
    open.pop_back();
    const std::vector<RepairChange> done = repair(cell, repairs);
    changes.insert(changes.end(), done.begin(), done.end());
    CellParts parts = one_cell_a_file || done.empty() ? CellParts() : cellPartsOf(cell);
    for (auto part = parts.cells.rbegin(); part != parts.cells.rend(); ++part) {
      part->source = cell.source;
      part->header = cell.header;
      open.push_back(std::move(*part));
    }
    if (parts.cells.empty()) repaired.push_back(std::move(cell));
  }
  return repaired;
}

int runFix(const FixArguments& a) {
  const RepairOptions repairs = repairOptionsOf(a);
  InputOptions options;
  options.swc.apply_offset = a.apply_offset;
  options.swc.soma_links = !a.no_soma_links;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  options.one_cell_a_file = a.one_cell_a_file;
  readUnit(a.unit, options.swc);
  a.reading->apply(options);
  Progress progress({.title = "fix", .noun = "", .unit = ProgressUnit::bytes});
  options.progress = [&](std::uint64_t done, std::uint64_t total) {
    throwIfInterrupted();
    progress.setTotal(total);
    progress.update(done);
  };
  refuseAddress("--output", a.out);
  refuseSeveralCircuits(a.inputs);
  if (Circuit::isCircuit(a.inputs, {}))
    throw UsageError("fix is for neurons; the cells of a circuit are placed by 'filiform ingest'");
  std::vector<NamedPath> inputs;
  for (const std::string& path : a.inputs)
    if (!isAddress(path)) inputs.push_back({"INPUT", path});
  checkOutputs(inputs, {{"--report", a.report}});
  checkOutputFolder(inputs, {"--output", a.out});

  Input input(a.inputs, options);
  std::vector<std::string> sources, given;
  std::uint64_t looped = 0;
  for (Cell cell; input.next(cell);) {
    looped += cell.isGraph();
    if (cell.isGraph()) continue;
    std::vector<std::string> names = {cell.name};
    const std::string source = cell.source;
    if (repairs.drop_long_links) {  // what is left may be several cells
      std::vector<RepairChange> changes;
      names.clear();
      for (const Cell& repaired : repairedCells(std::move(cell), repairs, a.one_cell_a_file, changes))
        names.push_back(repaired.name);
    }
    sources.insert(sources.end(), names.size(), source);
    given.insert(given.end(), names.begin(), names.end());
  }
  requireUsable(input.reports(), nullptr, false);
  if (sources.empty())
    throw InputError(inShort(a.inputs.front()) +
                     ": no cell without loops, and SWC cannot hold loops; use ingest and export");
  const std::vector<std::string> names = safeFileNames(cellNames(sources, given));

  OutputFolder folder(a.out, a.force);
  const std::string changes = a.report.empty() ? (std::filesystem::path(a.out) / kChanges).string() : a.report;
  if (a.report.empty() && !std::filesystem::exists(changes)) folder.note(kChanges);
  Output report(changes, {.cancel = &interruptFlag()});
  std::ostream& people = report.isStandardOutput() ? std::cerr : std::cout;
  ChangeTable table(report.stream());
  if (!options.swc.isMicrometres())
    table.row("-", 0, "", "unit", "--unit " + a.unit + ": converted to um, in all formats that state no unit");
  forEachInput(input.reports(), [&](const std::string& name, const InputReport& read, const InputOutcome&) {
    table.read(name, read, a.apply_offset);
  });
  input.rewind();
  std::uint64_t changed = 0;
  std::size_t at = 0;
  for (Cell cell; input.next(cell);) {
    const std::string source = cell.source;
    if (cell.isGraph()) {
      table.row(source, 0, "", "left_out", "has loops, which SWC cannot hold; use ingest and export");
      continue;
    }
    std::vector<RepairChange> done;
    const std::vector<Cell> cells = repairedCells(std::move(cell), repairs, a.one_cell_a_file, done);
    for (const RepairChange& change : done) table.repaired(source, change);
    changed += done.size();
    for (const Cell& repaired : cells) {
      if (at >= sources.size() || sources[at] != source)
        throw IoError(inShort(source), "changed while it was being read; run again");
      std::ostringstream text;
      writeCleanSwc(text, repaired);
      folder.write(names[at] + ".swc", std::move(text).str());
      table.row(source, 0, "", "written", names[at++] + ".swc");
    }
  }
  if (at < sources.size()) throw IoError(inShort(sources[at]), "changed while it was being read; run again");
  report.finish();
  folder.finish();
  progress.finish();
  people << summary(input.reports());
  if (looped > 0)
    people << "  left out " << counted(looped, "cell") << " with loops, which SWC cannot hold; use ingest and export\n";
  people << inShort(a.out) << ": " << counted(at, "file") << "; " << counted(changed, "repair") << "; "
         << inShort(changes) << " lists each change\n";
  return 0;
}

}  // namespace

void addFix(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<FixArguments>();
  CLI::App* command = app.add_subcommand("fix", "Write neurons as clean SWC files, with a record of each change");
  command->footer(
      "Examples:\n  filiform fix archive.zip -o clean/\n  filiform fix cell.swc -o mended/ --drop-long-links "
      "--join-gaps 5\n"
      "Without options, fix writes what ingest would keep: one line a sample, parents first, positions in um as they "
      "were "
      "read. It changes nothing else. 'filiform check' names what the options change.");
  command->add_option("INPUT", a->inputs, kInputHelp)->required();
  command->add_option("-o,--output", a->out, "write the SWC files and changes.tsv to this folder")
      ->required()
      ->type_name("DIR");
  command->add_flag("--drop-long-links", a->drop_long_links,
                    "cut links longer than 20 times the median of a cell that check doubts for them");
  command
      ->add_option("--join-gaps", a->gap,
                   "link the end of a tree to the nearest sample of another tree within UM, at most 100")
      ->type_name("UM");
  command->add_flag("--soma-links", a->soma_links, "link trees that begin within 50 um of a soma to it");
  command->add_option("--unknown-radius", a->unknown_radius, "write radii that are unknown as R um")
      ->capture_default_str()
      ->type_name("R");
  command->add_option("--unit", a->unit, kUnitHelp)->capture_default_str();
  command->add_flag("--apply-offset", a->apply_offset, "add the '# OFFSET' of each header to its positions");
  command->add_flag("--no-soma-links", a->no_soma_links,
                    "leave out the links from somata to neurites that ASC and H5 files do not state");
  command->add_flag("--one-cell-a-file", a->one_cell_a_file, "keep a file that holds several cells as one cell");
  a->reading = addReadingArguments(*command);
  command->add_option("--report", a->report, "write the changes to this file instead of changes.tsv in the folder")
      ->type_name("FILE");
  command->add_flag("--force", a->force, "write into a folder that is not empty, and replace files of the same names");
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runFix(*a); }; });
}

}  // namespace filiform::tools
