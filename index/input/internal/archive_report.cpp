#include "index/input/internal/archive_report.h"

#include <utility>
#include <vector>

namespace filiform::internal {

void listEntries(const Container& archive, SourceReport& row) {
  std::vector<EntryReport>& entries = row.entries;
  entries.clear();
  entries.reserve(archive.entries().size());
  for (const ArchiveEntry& entry : archive.entries()) {
    EntryReport report{entry.name, entry.bytes, 0, entry.skipped && !entry.passed, {}, entry.label};
    if (entry.passed) {
      report.report.severity = Severity::kPassed;
    } else if (entry.skipped) {
      for (const InputCode code : entry.remarks) {
        report.report.codes.add(code);
        report.report.records.add({0, code, Effect::kInputRefused, entry.refusal_token});
      }
      if (report.report.codes.anyWarning()) report.report.severity = Severity::kWarn;
      if (report.report.codes.anyRefusal()) report.report.severity = Severity::kRefuse;
    }
    entries.push_back(std::move(report));
  }
}

void sumEntries(const Container& container, bool strict, SourceReport& row) {
  InputReport& sum = row.report;
  sum = {};
  bool any_kept = false, any_other = false;
  for (const EntryReport& entry : row.entries) {
    const InputReport& part = entry.report;
    if (part.severity == Severity::kPassed) continue;
    any_kept = any_kept || !entry.dropped;
    any_other = any_other || part.codes[InputCode::E_NO_SAMPLES] == 0;
    sum.samples += part.samples;
    sum.segments += part.segments;
    sum.isolated += part.isolated;
    sum.roots += part.roots;
    sum.candidate_lines += part.candidate_lines;
    sum.dropped_lines += part.dropped_lines;
    sum.merged_points += part.merged_points;
    sum.links_given += part.links_given;
    sum.links_cut += part.links_cut;
    sum.codes.add(part.codes);
  }
  if (container.refusal()) {
    sum.codes.add(*container.refusal());
    sum.records.add({0, *container.refusal(), Effect::kInputRefused, container.refusal_token()});
  }
  if (!container.refusal() && !any_kept && !any_other) {
    sum.codes.add(InputCode::E_ZIP_NO_SWC);
    sum.records.add({0, InputCode::E_ZIP_NO_SWC, Effect::kInputRefused, {}});
  }
  const bool flawed = sum.codes.anyRefusal() || sum.codes.anyWarning();
  const bool refuse = !any_kept || (strict && flawed);
  sum.severity = refuse ? Severity::kRefuse : flawed ? Severity::kWarn : Severity::kAccept;
}

}  // namespace filiform::internal
