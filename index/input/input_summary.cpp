// Prints the table of `check` and the summary of inputs.
#include "index/count_text.h"
#include "index/formats/unread_formats.h"
#include "index/input/input.h"
#include "index/text.h"

#include <algorithm>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>

namespace filiform {
namespace {

constexpr std::size_t kNamedInputs = 20, kNamedEndings = 20;

// Where a code occurs first, as `input:line`; empty if no line is recorded.
std::string firstPlace(const std::vector<SourceReport>& reports, InputCode code) {
  std::string place;
  forEachInput(reports, [&](const std::string& input, const InputReport& report, const InputOutcome&) {
    if (!place.empty() || report.codes[code] == 0) return;
    for (auto record = report.records.begin(); place.empty() && record != report.records.end(); ++record)
      if (record->code == code && record->line > 0) place = inShort(input) + ":" + std::to_string(record->line);
  });
  return place;
}

}  // namespace

bool anyDropped(const SourceReport& row) {
  if (!row.archive && row.report.records.count(Effect::kLineDropped) > 0) return true;
  return std::any_of(row.entries.begin(), row.entries.end(), [](const EntryReport& entry) {
    return entry.dropped || entry.report.records.count(Effect::kLineDropped) > 0;
  });
}

void writeDropped(const SourceReport& row, const std::function<void(std::string_view piece)>& use) {
  std::string piece;
  bool first = true;
  const auto begin = [&] {
    piece = first ? "" : ",";
    first = false;
  };
  const auto write_lines = [&](const InputReport& report, const std::string& before) {
    if (report.records.count(Effect::kLineDropped) == 0) return;
    for (auto record = report.records.begin(); record != report.records.end(); ++record) {
      if (record->effect != Effect::kLineDropped) continue;
      begin();
      piece += before;
      piece += std::to_string(record->line);
      use(piece);
    }
  };
  if (!row.archive) write_lines(row.report, "");
  for (const EntryReport& entry : row.entries) {
    if (!entry.dropped) {
      write_lines(entry.report, escaped(entry.entry) + ":");
      continue;
    }
    begin();
    use(piece += escaped(entry.entry));
  }
}

InputTotals totals(const std::vector<SourceReport>& reports) {
  InputTotals sum;
  std::uint64_t* const counts[] = {&sum.accepted, &sum.warned, &sum.skipped, &sum.refused};  // by InputFate
  forEachInput(reports, [&](const std::string& input, const InputReport&, const InputOutcome& outcome) {
    ++(outcome.fate == InputFate::kPassed ? sum.passed_over[countedEnding(input)]
                                          : *counts[static_cast<std::size_t>(outcome.fate)]);
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

Severity verdict(const std::vector<SourceReport>& reports) {
  Severity worst = Severity::kAccept;
  for (const SourceReport& row : reports) worst = std::max(worst, row.report.severity);
  return worst;
}

bool anyRefused(const std::vector<SourceReport>& reports) { return verdict(reports) == Severity::kRefuse; }

void writeCheckTable(std::ostream& out, const std::vector<SourceReport>& reports) {
  out << "file\tseverity\tsamples\tsegments\tdropped\tcodes\n";
  for (const SourceReport& row : reports) {
    out << escaped(row.file) << '\t' << name(row.report.severity) << '\t' << row.report.samples << '\t'
        << row.report.segments << '\t';
    if (anyDropped(row))
      writeDropped(row, [&](std::string_view piece) { out << piece; });
    else
      out << '-';
    out << '\t' << codesText(row.report.codes) << '\n';
  }
}

std::string passedOverText(const std::map<std::string, std::uint64_t>& passed_over) {
  std::vector<std::pair<std::string, std::uint64_t>> endings(passed_over.begin(), passed_over.end());
  std::stable_sort(endings.begin(), endings.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text;
  for (std::size_t i = 0; i < std::min(endings.size(), kNamedEndings); ++i) {
    const std::string_view format = unreadFormat(endings[i].first);
    text += (i > 0 ? ", " : "") + formatCount(endings[i].second) + " " + endings[i].first +
            (format.empty() ? "" : " (" + std::string(format) + ")");
  }
  if (endings.size() > kNamedEndings) text += ", and " + counted(endings.size() - kNamedEndings, "more ending");
  return text;
}

std::string summary(const std::vector<SourceReport>& reports) {
  const InputTotals sum = totals(reports);
  std::string out = counted(sum.inputs(), "input") + ": " + formatCount(sum.accepted) + " accepted, " +
                    formatCount(sum.warned) + " with warnings, " +
                    (sum.skipped > 0 ? formatCount(sum.skipped) + " skipped, " : "") + formatCount(sum.refused) +
                    " refused; " + counted(sum.samples, "sample") + ", " + counted(sum.segments, "segment") + " kept\n";
  if (!sum.passed_over.empty()) out += "  passed over: " + passedOverText(sum.passed_over) + "\n";
  for (const auto& [code, count] : sum.codes.all()) {
    if (isRefusal(code)) continue;
    const std::string first = firstPlace(reports, code);
    out += "  " + std::string(name(code)) + " " + formatCount(count) + ": " + std::string(explanation(code)) +
           (first.empty() ? "" : " (first: " + first + ")") + "\n";
  }
  for (const InputFate fate : {InputFate::kRefused, InputFate::kSkipped}) {
    const std::string word = " " + std::string(name(fate));
    std::size_t named = 0;
    forEachInput(reports, [&](const std::string& input, const InputReport& report, const InputOutcome& outcome) {
      if (report.codes[InputCode::OTHER_VERSION] > 0) return;  // counted above; there may be many
      if (outcome.fate == fate && ++named <= kNamedInputs)
        out += " " + word + " " + inShort(input) + ": " + outcome.reason +
               (outcome.code.empty() ? "" : " (" + outcome.code + ")") + "\n";
    });
    if (named > kNamedInputs) out += "  and " + formatCount(named - kNamedInputs) + " more" + word + "\n";
  }
  return out;
}

}  // namespace filiform
