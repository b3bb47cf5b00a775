#include "index/input/internal/archive_report.h"

#include <utility>
#include <vector>

namespace filiform::internal {

void listEntries(const Archive& archive, SourceReport& row) {
  std::vector<EntryReport>& entries = row.entries;
  entries.clear();
  entries.reserve(archive.entries().size());
  for (const ArchiveEntry& entry : archive.entries()) {
    EntryReport report{entry.name, entry.bytes, 0, entry.skipped, {}};
    if (entry.skipped) {
      report.report.severity = Severity::kWarn;
      for (const InputCode code : entry.remarks) {
        report.report.codes.add(code);
        report.report.records.add({0, code, Effect::kInputRefused, {}});
      }
    }
    entries.push_back(std::move(report));
  }
}

void sumEntries(const Archive& archive, bool strict, SourceReport& row) {
  InputReport& sum = row.report;
  sum = {};
  bool any_kept = false;
  for (const EntryReport& entry : row.entries) {
    const InputReport& part = entry.report;
    any_kept = any_kept || !entry.dropped;
    sum.samples += part.samples;
    sum.segments += part.segments;
    sum.isolated += part.isolated;
    sum.roots += part.roots;
    sum.candidate_lines += part.candidate_lines;
    sum.dropped_lines += part.dropped_lines;
    sum.links_given += part.links_given;
    sum.links_cut += part.links_cut;
    sum.codes.add(part.codes);
  }
  if (archive.refusal()) {
    sum.codes.add(*archive.refusal());
    sum.records.add({0, *archive.refusal(), Effect::kInputRefused, {}});
  }
  const bool refuse = !any_kept || (strict && !sum.codes.empty());
  sum.severity = refuse ? Severity::kRefuse : sum.codes.empty() ? Severity::kAccept : Severity::kWarn;
}

}  // namespace filiform::internal
