// filiform ingest: SWC files, folders and archives become a tile set.
#include "index/errors.h"
#include "index/ingest.h"
#include "index/input.h"
#include "index/text.h"
#include "tools/cli.h"
#include "tools/progress.h"

#include <cmath>
#include <fstream>
#include <iostream>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using Json = nlohmann::ordered_json;

struct IngestArguments {
  std::vector<std::string> inputs;
  std::string out, unit = "um", quantum = "2^-9", memory = "1GiB", report;
  std::uint32_t capacity = PartitionOptions{}.capacity;
  unsigned threads = 0;
  bool apply_offset = false, strict = false, force = false;
};

double unitOf(const std::string& text) {
  if (text == "um") return 1;
  if (text == "nm") return 1e-3;
  if (text == "mm") return 1e3;
  const double um = parseNumber("--unit", text);
  if (!(um > 0)) throw UsageError("--unit " + text + ": give um, nm, mm, or the size of a voxel in um");
  return um;
}

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
    throw UsageError("--quantum " + text + ": give a power of two from 2^" + std::to_string(Grid::kMinExponent) +
                     " to 2^" + std::to_string(Grid::kMaxExponent) + " um, such as 2^-9");
  return exponent;
}

std::string textOf(const Json& json) { return json.dump(1, ' ', false, Json::error_handler_t::replace); }

Json describe(const InputReport& report) {
  Json codes = Json::object(), records = Json::array();
  for (const auto& [code, count] : report.codes.all()) codes[std::string(name(code))] = count;
  for (const InputRecord& r : report.records)
    records.push_back({{"line", r.line}, {"code", std::string(name(r.code))}, {"token", r.token}});
  return {{"severity", std::string(name(report.severity))},
          {"samples", report.samples},
          {"segments", report.segments},
          {"dropped_lines", report.dropped_lines},
          {"links_cut", report.links_cut},
          {"codes", codes},
          {"records", records}};
}

void writeReport(const std::string& path, const std::vector<SourceReport>& reports) {
  Json all = Json::array();
  for (const SourceReport& source : reports) {
    Json row = {{"file", source.file}, {"bytes", source.bytes}};
    row.update(describe(source.report));
    if (source.archive) {
      row["entries"] = Json::array();
      for (const EntryReport& entry : source.entries) {
        Json one = {{"entry", entry.entry}, {"bytes", entry.bytes}};
        one.update(describe(entry.report));
        row["entries"].push_back(one);
      }
    }
    all.push_back(row);
  }
  std::ofstream file(path, std::ios::binary);
  file << textOf(all) << '\n';
  file.close();
  if (!file) throw IoError(escaped(path), "cannot write the report", errno);
}

std::string firstReason(const InputReport& report) {
  return report.codes.anyRefusal() ? std::string(explanation(report.codes.all().front().first))
                                   : "warnings under --strict";
}

std::string firstCode(const InputReport& report) {
  return report.codes.empty() ? "" : std::string(name(report.codes.all().front().first));
}

Provenance provenanceOf(const std::vector<SourceReport>& reports) {
  Provenance provenance;
  const InputTotals all = totals(reports);
  for (const auto& [code, count] : all.codes.all()) provenance.codes[std::string(name(code))] = count;
  for (const SourceReport& source : reports) {
    std::uint64_t cells = 0;
    if (source.archive) {
      for (const EntryReport& entry : source.entries) {
        if (entry.report.severity == Severity::kRefuse || entry.dropped)
          provenance.refused.push_back(
              {source.file + "/" + entry.entry, firstCode(entry.report), firstReason(entry.report)});
        else
          ++cells;
      }
    } else if (source.report.severity != Severity::kRefuse) {
      cells = 1;
    }
    if (source.report.severity == Severity::kRefuse)
      provenance.refused.push_back({source.file, firstCode(source.report), firstReason(source.report)});
    const std::string dropped = droppedColumn(source);
    provenance.sources.push_back({source.file, source.bytes, source.digest, cells, dropped == "-" ? "" : dropped});
  }
  return provenance;
}

int runIngest(const IngestArguments& a) {
  IngestOptions options;
  options.capacity = a.capacity;
  options.quantum_exponent = quantumExponentOf(a.quantum);
  options.threads = a.threads;
  options.force = a.force;
  options.cancel = &interruptFlag();
  const std::uint64_t memory = parseBytes("--memory", a.memory);

  InputOptions reading;
  reading.swc = {.unit_um = unitOf(a.unit), .apply_offset = a.apply_offset, .strict = a.strict};
  Progress read_progress({.title = "reading", .noun = "", .unit = ProgressUnit::bytes});
  reading.progress = [&](std::uint64_t done, std::uint64_t total) {
    throwIfInterrupted();
    read_progress.setTotal(total);
    read_progress.update(done);
  };
  Input input(a.inputs, reading);
  options.provenance = [&] {
    read_progress.finish();
    const InputTotals all = totals(input.reports());
    if (!a.report.empty()) writeReport(a.report, input.reports());
    if (a.strict && all.refused > 0)
      throw InputError("--strict: " + std::to_string(all.refused) + " of " +
                       std::to_string(all.accepted + all.warned + all.refused) +
                       " inputs refused, nothing written; filiform check says which and why");
    if (all.accepted + all.warned == 0) {
      const std::vector<SourceReport>& reports = input.reports();
      const std::string first = reports.empty()
                                    ? "nothing was read"
                                    : escaped(reports.front().file) + ": " + firstReason(reports.front().report);
      throw InputError("no usable neuron in the input (" + first + "); filiform check says more");
    }
    return provenanceOf(input.reports());
  };
  std::unique_ptr<Progress> building;
  std::string phase_now;
  options.progress = [&](const char* phase, std::uint64_t done, std::uint64_t total) {
    throwIfInterrupted();
    if (phase_now != phase) {
      phase_now = phase;
      read_progress.finish();
      building = std::make_unique<Progress>(ProgressOptions{.title = phase, .noun = "", .total = total});
    }
    building->setTotal(total);
    building->update(done);
  };

  const IngestResult result = ingest(input, a.out, options);
  if (building) building->finish();
  std::cout << summary(input.reports());
  const SetCounts& n = result.counts;
  std::cout << escaped(a.out) << ": " << formatCount(n.cells) << (n.cells == 1 ? " cell, " : " cells, ")
            << formatCount(n.samples) << " samples, " << formatCount(n.segments) << " segments in "
            << formatCount(n.tiles) << " tiles, " << formatBytes(result.bytes)
            << (result.unchanged ? " (the same as before: left as it was)" : "") << '\n';
  constexpr std::uint64_t kWorkingBytesPerSegment = 150;
  if ((n.segments + n.isolated) * kWorkingBytesPerSegment > memory)
    std::cerr << "filiform: note: this build ingests in memory and took about "
              << formatBytes((n.segments + n.isolated) * kWorkingBytesPerSegment) << ", more than --memory " << a.memory
              << '\n';
  return 0;
}

}  // namespace

void addIngest(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<IngestArguments>();
  CLI::App* command = app.add_subcommand("ingest", "Cut SWC files, folders and archives into a tile set");
  command->footer(
      "Example:\n  filiform ingest archive.zip more/*.swc -o column.fil\n"
      "Files that cannot be used are counted and named; the others go in. filiform check tells the rest beforehand.");
  command->add_option("INPUT", a->inputs, "SWC files, folders, zip archives")->required();
  command->add_option("-o,--output", a->out, "tile set to make (a folder)")->required()->type_name("SET");
  command->add_option("--capacity", a->capacity, "segments a tile at most")
      ->capture_default_str()
      ->check(CLI::Range(1u, 1u << 30));
  command->add_option("--quantum", a->quantum, "grid of the positions, um, a power of two")->capture_default_str();
  command->add_option("--unit", a->unit, "unit of the files: um, nm, mm, or um per voxel")->capture_default_str();
  command->add_flag("--apply-offset", a->apply_offset, "add the '# OFFSET' of each header to its positions");
  command->add_option("--memory", a->memory, "memory wanted; this build only says when it needs more")
      ->capture_default_str()
      ->type_name("BYTES");
  command->add_option("--threads", a->threads, "0: as many as there are cores")->capture_default_str();
  command->add_flag("--strict", a->strict, "refuse files with any warning, and write nothing if one is refused");
  command->add_flag("--force", a->force, "replace an existing set");
  command->add_option("--report", a->report, "write everything dropped, cut or remarked as JSON")->type_name("FILE");
  command->callback([a, &chosen] { chosen = [a] { return runIngest(*a); }; });
}

}  // namespace filiform::tools
