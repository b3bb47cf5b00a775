// What is printed about inputs: the table of `check` and the summary for people.
#include "index/input.h"
#include "index/text.h"

#include <ostream>
#include <string>
#include <string_view>

namespace filiform {
namespace {

constexpr std::size_t kNamedInputs = 20;

void appendPart(std::string& list, std::string_view part) {
  if (!list.empty()) list += ',';
  list += part;
}

std::string codesColumn(const CodeCounts& codes) {
  std::string list;
  for (const auto& [code, count] : codes.all()) appendPart(list, std::string(name(code)) + ":" + std::to_string(count));
  return list.empty() ? "-" : list;
}

std::string reason(const InputReport& report) {
  for (const auto& [code, count] : report.codes.all()) {
    if (isRefusal(code) || report.severity == Severity::kWarn) {
      return std::string(explanation(code)) + " (" + std::string(name(code)) + ")";
    }
  }
  return "warnings, refused as --strict asks (" + codesColumn(report.codes) + ")";
}

std::string grouped(std::uint64_t count) {
  const std::string digits = std::to_string(count);
  std::string out;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) out += ' ';
    out += digits[i];
  }
  return out;
}

// Calls `use(name, report, dropped)` for each input: plain files, entries, and archives that are refused as such.
template <class Use>
void forEachInput(const std::vector<SourceReport>& rows, Use use) {
  for (const SourceReport& row : rows) {
    const bool archive_refused = row.archive && !row.report.records.empty();
    if (!row.archive || archive_refused) use(row.file, row.report, row.report.severity == Severity::kRefuse);
    for (const EntryReport& entry : row.entries) use(row.file + "/" + entry.entry, entry.report, entry.dropped);
  }
}

}  // namespace

std::string droppedColumn(const SourceReport& row) {
  std::string dropped;
  const auto append_lines = [&](const InputReport& report, const std::string& before) {
    for (const InputRecord& record : report.records) {
      if (record.effect == Effect::kLineDropped) appendPart(dropped, before + std::to_string(record.line));
    }
  };
  if (!row.archive) append_lines(row.report, "");
  for (const EntryReport& entry : row.entries) {
    if (entry.dropped) {
      appendPart(dropped, escaped(entry.entry));
    } else {
      append_lines(entry.report, escaped(entry.entry) + ":");
    }
  }
  return dropped.empty() ? "-" : dropped;
}

InputTotals totals(const std::vector<SourceReport>& reports) {
  InputTotals sum;
  forEachInput(reports, [&](const std::string&, const InputReport& report, bool dropped) {
    ++(dropped ? sum.refused : report.severity == Severity::kWarn ? sum.warned : sum.accepted);
  });
  for (const SourceReport& row : reports) {
    sum.bytes += row.bytes;
    sum.samples += row.report.samples;
    sum.segments += row.report.segments;
    sum.isolated += row.report.isolated;
    sum.roots += row.report.roots;
    sum.codes.add(row.report.codes);
  }
  return sum;
}

bool anyRefused(const std::vector<SourceReport>& reports) {
  for (const SourceReport& row : reports) {
    if (row.report.severity == Severity::kRefuse) return true;
  }
  return false;
}

void writeCheckTable(std::ostream& out, const std::vector<SourceReport>& reports) {
  out << "file\tseverity\tsamples\tsegments\tdropped\tcodes\n";
  for (const SourceReport& row : reports) {
    out << escaped(row.file) << '\t' << name(row.report.severity) << '\t' << row.report.samples << '\t'
        << row.report.segments << '\t' << droppedColumn(row) << '\t' << codesColumn(row.report.codes) << '\n';
  }
}

std::string summary(const std::vector<SourceReport>& reports) {
  const InputTotals sum = totals(reports);
  std::string out = grouped(sum.accepted + sum.warned + sum.refused) + " inputs: " + grouped(sum.accepted) +
                    " accepted, " + grouped(sum.warned) + " with warnings, " + grouped(sum.refused) + " refused; " +
                    grouped(sum.samples) + " samples, " + grouped(sum.segments) + " segments kept\n";
  for (const auto& [code, count] : sum.codes.all()) {
    if (!isRefusal(code))
      out += "  " + std::string(name(code)) + " " + grouped(count) + ": " + std::string(explanation(code)) + "\n";
  }
  std::size_t named = 0;
  forEachInput(reports, [&](const std::string& input, const InputReport& report, bool dropped) {
    if (dropped && ++named <= kNamedInputs) out += "  refused " + escaped(input) + ": " + reason(report) + "\n";
  });
  if (named > kNamedInputs) out += "  and " + grouped(named - kNamedInputs) + " more refused\n";
  return out;
}

}  // namespace filiform
