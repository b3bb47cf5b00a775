#include "index/ingest/input_provenance.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace filiform {
namespace {

std::string firstCode(const InputReport& report) {
  return report.codes.empty() ? "" : std::string(name(report.codes.all().front().first));
}

void addSource(const SourceReport& source, Provenance& provenance) {
  std::uint64_t cells = 0;
  if (source.archive) {
    for (const EntryReport& entry : source.entries) {
      if (entry.report.codes[InputCode::OTHER_VERSION] > 0) continue;  // counted with the codes
      if (entry.report.severity == Severity::kRefuse || entry.dropped)
        provenance.refused.push_back(
            {source.file + "/" + entry.entry, firstCode(entry.report), refusedFor(entry.report)});
      else
        ++cells;
    }
  } else if (source.report.severity != Severity::kRefuse && !source.left_out) {
    cells = 1;
  }
  if (source.report.severity == Severity::kRefuse)
    provenance.refused.push_back({source.file, firstCode(source.report), refusedFor(source.report)});
  provenance.sources.push_back({source.file, source.bytes, source.digest, cells});
  if (anyDropped(source)) provenance.sources.back().dropped = [&source](const auto& use) { writeDropped(source, use); };
}

// The table joins the sources, with all cells to its name. Rows are named by what they place, so that the manifest does
// not depend on their order.
void addPlacements(const PlacedCells& placed, Provenance& provenance) {
  const PlacementReport& report = placed.report();
  const PlacementTable& table = placed.table();
  for (const auto& [code, count] : report.codes.all()) provenance.codes[std::string(name(code))] += count;
  std::vector<std::string> tokens;
  for (const InputRecord& record : report.records)
    if (!record.token.empty()) tokens.push_back(record.token);
  std::sort(tokens.begin(), tokens.end());
  std::string dropped;
  for (const std::string& token : tokens) dropped += (dropped.empty() ? "" : ",") + token;
  for (Provenance::Source& source : provenance.sources) source.cells = 0;
  provenance.sources.push_back({table.file(), table.bytes(), table.digest(), report.placed});
  if (!dropped.empty()) provenance.sources.back().dropped = [dropped](const auto& use) { use(dropped); };
}

}  // namespace

std::string refusedFor(const InputReport& report) {
  const std::string reason = refusalReason(report);
  return reason.empty() ? "warnings under --strict" : reason;
}

Provenance provenanceOf(const std::vector<SourceReport>& reports, const PlacedCells* placed) {
  Provenance provenance;
  const InputTotals all = totals(reports);
  for (const auto& [code, count] : all.codes.all()) provenance.codes[std::string(name(code))] = count;
  for (const SourceReport& source : reports) addSource(source, provenance);
  if (placed != nullptr) addPlacements(*placed, provenance);
  // The bytes of a set do not depend on the order of the arguments.
  std::sort(provenance.sources.begin(), provenance.sources.end(), [](const auto& x, const auto& y) {
    return std::tie(x.name, x.digest, x.bytes) < std::tie(y.name, y.digest, y.bytes);
  });
  std::sort(provenance.refused.begin(), provenance.refused.end(), [](const auto& x, const auto& y) {
    return std::tie(x.name, x.code, x.reason) < std::tie(y.name, y.code, y.reason);
  });
  return provenance;
}

}  // namespace filiform
