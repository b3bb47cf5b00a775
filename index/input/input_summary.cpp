// Prints the table of `check` and the summary of inputs.
#include "index/count_text.h"
#include "index/input/input.h"
#include "index/text.h"

#include <algorithm>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>

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
  if (!report.codes.empty() && (report.codes.anyRefusal() || report.severity == Severity::kWarn)) {
    const InputCode code = report.codes.all().front().first;
    const std::string why = isRefusal(code) ? refusalReason(report) : std::string(explanation(code));
    return why + " (" + std::string(name(code)) + ")";
  }
  return "warnings, refused because of --strict (" + codesColumn(report.codes) + ")";
}

InputFate fateOf(const InputReport& report) {
  switch (report.severity) {
    case Severity::kAccept:
      return InputFate::kAccepted;
    case Severity::kWarn:
      return InputFate::kWarned;
    case Severity::kRefuse:
      return InputFate::kRefused;
  }
  return InputFate::kRefused;
}

// Calls `use(name, report, fate)` for each input: plain files, entries, and refused archives without a refused entry.
template <class Use>
void forEachInput(const std::vector<SourceReport>& rows, Use use) {
  for (const SourceReport& row : rows) {
    const bool refused = row.report.severity == Severity::kRefuse;
    const auto fate = [&](const EntryReport& entry) {
      if (!entry.dropped) return fateOf(entry.report);
      return refused && entry.report.severity == Severity::kRefuse ? InputFate::kRefused : InputFate::kSkipped;
    };
    const bool told = std::any_of(row.entries.begin(), row.entries.end(),
                                  [&](const EntryReport& entry) { return fate(entry) == InputFate::kRefused; });
    if (!row.archive || (refused && !told))
      use(row.file, row.report, row.left_out ? InputFate::kSkipped : fateOf(row.report));
    for (const EntryReport& entry : row.entries) use(row.file + "/" + entry.entry, entry.report, fate(entry));
  }
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
  forEachInput(reports, [&](const std::string&, const InputReport&, InputFate fate) {
    switch (fate) {
      case InputFate::kAccepted:
        ++sum.accepted;
        break;
      case InputFate::kWarned:
        ++sum.warned;
        break;
      case InputFate::kSkipped:
        ++sum.skipped;
        break;
      case InputFate::kRefused:
        ++sum.refused;
        break;
    }
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
    out << '\t' << codesColumn(row.report.codes) << '\n';
  }
}

std::string summary(const std::vector<SourceReport>& reports) {
  const InputTotals sum = totals(reports);
  std::string out = counted(sum.accepted + sum.warned + sum.skipped + sum.refused, "input") + ": " +
                    formatCount(sum.accepted) + " accepted, " + formatCount(sum.warned) + " with warnings, " +
                    (sum.skipped > 0 ? formatCount(sum.skipped) + " skipped, " : "") + formatCount(sum.refused) +
                    " refused; " + counted(sum.samples, "sample") + ", " + counted(sum.segments, "segment") + " kept\n";
  for (const auto& [code, count] : sum.codes.all()) {
    if (!isRefusal(code))
      out += "  " + std::string(name(code)) + " " + formatCount(count) + ": " + std::string(explanation(code)) + "\n";
  }
  for (const auto& kind : {std::pair(InputFate::kRefused, " refused"), {InputFate::kSkipped, " skipped"}}) {
    const InputFate fate = kind.first;  // clang 14 cannot capture structured bindings in lambdas
    const char* const word = kind.second;
    std::size_t named = 0;
    forEachInput(reports, [&](const std::string& input, const InputReport& report, InputFate its_fate) {
      if (report.codes[InputCode::OTHER_VERSION] > 0) return;  // counted above; there may be many
      if (its_fate == fate && ++named <= kNamedInputs)
        out += " " + std::string(word) + " " + inShort(input) + ": " + reason(report) + "\n";
    });
    if (named > kNamedInputs) out += "  and " + formatCount(named - kNamedInputs) + " more" + word + "\n";
  }
  return out;
}

}  // namespace filiform
