#include "index/input/input_outcome.h"

#include "index/formats/unread_formats.h"

#include <algorithm>

namespace filiform {
namespace {

InputOutcome outcomeAs(InputFate fate, const std::string& file, const InputReport& report) {
  InputOutcome outcome{fate, {}, {}};
  if (fate == InputFate::kPassed) outcome.reason = whyPassedOver(file);
  if (!outcome.isLost()) return outcome;
  if (report.codes.empty() || (report.severity == Severity::kRefuse && !report.codes.anyRefusal())) {
    outcome.reason = !report.doubts.empty()
                         ? "refused for its doubts, because of --profile strict: " + report.doubts
                         : "refused for its warnings, as strict reading does: " + codesText(report.codes);
    return outcome;
  }
  const InputCode code = report.codes.all().front().first;
  outcome.code = name(code);
  outcome.reason = isRefusal(code) ? refusalReason(report) : explanation(code);
  return outcome;
}

InputFate fateBySeverity(const InputReport& report) {
  switch (report.severity) {
    case Severity::kPassed:
      return InputFate::kPassed;
    case Severity::kAccept:
      return InputFate::kAccepted;
    case Severity::kWarn:
      return InputFate::kWarned;
    default:
      return InputFate::kRefused;
  }
}

bool isRefused(const InputReport& report) { return report.severity == Severity::kRefuse; }

InputFate fateOf(const SourceReport& row, const EntryReport& entry) {
  if (!entry.dropped) return fateBySeverity(entry.report);
  return isRefused(row.report) && isRefused(entry.report) ? InputFate::kRefused : InputFate::kSkipped;
}

}  // namespace

std::string_view name(InputFate fate) {
  static constexpr std::string_view kNames[] = {"accepted", "warned", "skipped", "refused", "passed"};
  return kNames[static_cast<std::size_t>(fate)];
}

std::string codesText(const CodeCounts& codes) {
  std::string list;
  for (const auto& [code, count] : codes.all())
    list += (list.empty() ? "" : ",") + std::string(name(code)) + ":" + std::to_string(count);
  return list.empty() ? "-" : list;
}

std::optional<InputOutcome> outcomeOfInput(const SourceReport& row) {
  if (row.archive) {
    const bool told = std::any_of(row.entries.begin(), row.entries.end(),
                                  [&](const EntryReport& entry) { return fateOf(row, entry) == InputFate::kRefused; });
    if (!isRefused(row.report) || told) return std::nullopt;
  }
  return outcomeAs(row.left_out ? InputFate::kSkipped : fateBySeverity(row.report), row.file, row.report);
}

InputOutcome outcomeOfInput(const SourceReport& row, const EntryReport& entry) {
  return outcomeAs(fateOf(row, entry), entry.entry, entry.report);
}

void forEachInput(const std::vector<SourceReport>& reports, const UseInput& use) {
  for (const SourceReport& row : reports) {
    if (const std::optional<InputOutcome> outcome = outcomeOfInput(row)) use(row.file, row.report, *outcome);
    for (const EntryReport& entry : row.entries)
      use(row.file + "/" + entry.entry, entry.report, outcomeOfInput(row, entry));
  }
}

}  // namespace filiform
