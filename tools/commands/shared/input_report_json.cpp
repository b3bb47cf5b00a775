#include "tools/commands/shared/input_report_json.h"

#include "tools/words/open_json.h"

#include <optional>
#include <ostream>
#include <string>
#include <utility>

namespace filiform::tools {
namespace {

using Json = nlohmann::ordered_json;

// `outcome`: null for an archive whose entries count instead. `source`: of its cells.
Json figures(const char* title, const std::string& input, std::uint64_t bytes, const InputReport& report,
             const InputOutcome* outcome, const std::string& source, const SyncFates* fates) {
  Json members = {{title, input}, {"bytes", bytes}, {"severity", std::string(name(report.severity))}};
  if (outcome != nullptr) members["fate"] = std::string(name(outcome->fate));
  if (outcome != nullptr && !outcome->reason.empty()) members["reason"] = outcome->reason;
  if (fates != nullptr)
    if (const auto fate = fates->find(source); fate != fates->end()) members["sync"] = std::string(name(fate->second));
  members["samples"] = report.samples;
  members["segments"] = report.segments;
  members["dropped_lines"] = report.dropped_lines;
  members["links_cut"] = report.links_cut;
  members["codes"] = countsJson(report.codes);
  return members;
}

void writeRecords(const InputReport& report, OpenJson& object, std::ostream& out, std::size_t level) {
  object.beginList("records");
  for (auto r = report.records.begin(); r != report.records.end(); ++r) {
    object.beginElement();
    out << indentedJson({{"line", r->line},
                         {"code", std::string(name(r->code))},
                         {"effect", std::string(name(r->effect))},
                         {"token", r->token}},
                        level + 2);
  }
  object.endList();
}

}  // namespace

nlohmann::ordered_json countsJson(const CodeCounts& codes) {
  Json counts = Json::object();
  for (const auto& [code, count] : codes.all()) counts[std::string(name(code))] = count;
  return counts;
}

void writeSourceJson(std::ostream& out, const SourceReport& source, std::size_t level, const ReportExtras& extras) {
  const std::optional<InputOutcome> own = outcomeOfInput(source);
  OpenJson row(
      out, figures("file", source.file, source.bytes, source.report, own ? &*own : nullptr, source.file, extras.fates),
      level);
  row.beginText("dropped");
  if (anyDropped(source))
    writeDropped(source, [&](std::string_view piece) { row.addText(piece); });
  else
    row.addText("-");
  row.endText();
  writeRecords(source.report, row, out, level);
  if (source.archive) {
    row.beginList("entries");
    for (const EntryReport& entry : source.entries) {
      row.beginElement();
      const InputOutcome outcome = outcomeOfInput(source, entry);
      OpenJson one(out,
                   figures("entry", entry.entry, entry.bytes, entry.report, &outcome,
                           source.file + "/" + entry.shown_label(), extras.fates),
                   level + 2);
      writeRecords(entry.report, one, out, level + 2);
      one.end();
    }
    row.endList();
  }
  if (extras.findings != nullptr) {
    row.beginList("anatomy");
    for (const CellFindings* cell : extras.findings->of(source)) {
      row.beginElement();
      Json said = Json::array();
      for (const Finding& finding : cell->findings) said.push_back(findingJson(finding));
      out << indentedJson({{"cell", cell->shown()}, {"findings", std::move(said)}}, level + 2);
    }
    row.endList();
  }
  row.end();
}

void writeReportJson(std::ostream& out, const std::vector<SourceReport>& reports, const ReportExtras& extras) {
  out << '[';
  const char* between = "\n ";
  for (const SourceReport& source : reports) {
    out << std::exchange(between, ",\n ");
    writeSourceJson(out, source, 1, extras);
  }
  for (const auto& [source, fate] : extras.fates != nullptr ? *extras.fates : SyncFates())
    if (fate == SyncFate::kGone || fate == SyncFate::kRemoved)
      out << std::exchange(between, ",\n ") << indentedJson({{"file", source}, {"sync", std::string(name(fate))}}, 1);
  out << (*between == ',' ? "\n]\n" : "]\n");
}

}  // namespace filiform::tools
