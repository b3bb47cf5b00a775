#include "tools/commands/shared/input_report_json.h"

#include "tools/words/open_json.h"

#include <ostream>
#include <string>

#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using Json = nlohmann::ordered_json;

void addFigures(const InputReport& report, Json& members) {
  Json codes = Json::object();
  for (const auto& [code, count] : report.codes.all()) codes[std::string(name(code))] = count;
  members["severity"] = std::string(name(report.severity));
  members["samples"] = report.samples;
  members["segments"] = report.segments;
  members["dropped_lines"] = report.dropped_lines;
  members["links_cut"] = report.links_cut;
  members["codes"] = codes;
}

void writeRecords(const InputReport& report, OpenJson& object, std::ostream& out, std::size_t level) {
  object.beginList("records");
  for (auto r = report.records.begin(); r != report.records.end(); ++r) {
    object.beginElement();
    out << indentedJson({{"line", r->line}, {"code", std::string(name(r->code))}, {"token", r->token}}, level + 2);
  }
  object.endList();
}

void writeSource(const SourceReport& source, std::ostream& out) {
  Json members = {{"file", source.file}, {"bytes", source.bytes}};
  addFigures(source.report, members);
  OpenJson row(out, members, 1);
  writeRecords(source.report, row, out, 1);
  if (source.archive) {
    row.beginList("entries");
    for (const EntryReport& entry : source.entries) {
      row.beginElement();
      Json inner = {{"entry", entry.entry}, {"bytes", entry.bytes}};
      addFigures(entry.report, inner);
      OpenJson one(out, inner, 3);
      writeRecords(entry.report, one, out, 3);
      one.end();
    }
    row.endList();
  }
  row.end();
}

}  // namespace

void writeReportJson(std::ostream& out, const std::vector<SourceReport>& reports) {
  out << '[';
  const char* between = "\n ";
  for (const SourceReport& source : reports) {
    out << between;
    between = ",\n ";
    writeSource(source, out);
  }
  out << (reports.empty() ? "]\n" : "\n]\n");
}

}  // namespace filiform::tools
