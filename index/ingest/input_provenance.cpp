#include "index/ingest/input_provenance.h"

#include "index/containers/internal/file_kind.h"
#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

namespace filiform {
namespace {

void addSource(const SourceReport& source, Provenance& provenance) {
  std::uint64_t cells = 0;
  const auto take = [&](const std::string& input, const std::string& shown, const InputReport& report,
                        const InputOutcome& outcome) {
    if (report.codes[InputCode::OTHER_VERSION] > 0) return;  // counted with the codes
    const bool passed = outcome.fate == InputFate::kPassed;  // counted by its ending
    if (outcome.isLost() || (passed && internal::isReadInFolders(shown))) provenance.unusable.push_back(shown);
    if (passed) return;
    if (!outcome.isLost())
      cells += report.cells;
    else
      (outcome.fate == InputFate::kRefused ? provenance.refused : provenance.skipped)
          .push_back({input, outcome.code, outcome.reason});
  };
  if (const std::optional<InputOutcome> outcome = outcomeOfInput(source))
    take(source.file, source.file, source.report, *outcome);
  for (const EntryReport& entry : source.entries)
    take(source.file + "/" + entry.entry, source.file + "/" + entry.shown_label(), entry.report,
         outcomeOfInput(source, entry));
  if (source.report.severity == Severity::kPassed) return;
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

void requireUsable(const std::vector<SourceReport>& reports, const PlacedCells* placed, bool strict) {
  const InputTotals all = totals(reports);
  const bool refuse = strict && all.refused > 0;
  if (refuse || all.accepted + all.warned == 0) {
    std::string first;
    forEachInput(reports, [&](const std::string& input, const InputReport&, const InputOutcome& outcome) {
      if (first.empty() && (refuse ? outcome.fate == InputFate::kRefused : outcome.isLost()))
        first = escaped(input) + ": " + outcome.reason;
    });
    if (refuse)
      throw InputError("strict: " + std::to_string(all.refused) + " of " + std::to_string(all.inputs()) +
                       " inputs refused, nothing written; the first is " + first);
    throw InputError("no usable neuron in the input" + (first.empty() ? "" : " (" + first + ")"));
  }
  if (placed == nullptr) return;
  const PlacementReport& report = placed->report();
  const std::string table = escaped(placed->table().file());
  if (strict && !report.codes.empty())
    throw InputError("strict: " + table + ":" + std::to_string(report.records.front().line) + ": " +
                     std::string(explanation(report.records.front().code)) + "; nothing written");
  if (report.placed == 0) throw InputError(table + ": no row of the table places a morphology");
}

Provenance provenanceOf(const std::vector<SourceReport>& reports, const PlacedCells* placed) {
  Provenance provenance;
  const InputTotals all = totals(reports);
  for (const auto& [code, count] : all.codes.all()) provenance.codes[std::string(name(code))] = count;
  provenance.passed_over = all.passed_over;
  for (const SourceReport& source : reports) addSource(source, provenance);
  if (placed != nullptr) addPlacements(*placed, provenance);
  // The bytes of a set do not depend on the order of the arguments.
  std::sort(provenance.sources.begin(), provenance.sources.end(), [](const auto& x, const auto& y) {
    return std::tie(x.name, x.digest, x.bytes) < std::tie(y.name, y.digest, y.bytes);
  });
  for (auto* const lost : {&provenance.refused, &provenance.skipped})
    std::sort(lost->begin(), lost->end(), [](const auto& x, const auto& y) {
      return std::tie(x.name, x.code, x.reason) < std::tie(y.name, y.code, y.reason);
    });
  return provenance;
}

}  // namespace filiform
