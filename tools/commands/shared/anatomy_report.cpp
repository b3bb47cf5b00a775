#include "tools/commands/shared/anatomy_report.h"

#include "index/count_text.h"
#include "index/text.h"

#include <algorithm>

namespace filiform::tools {
namespace {

constexpr std::size_t kMostDoubts = 100, kPlacesInText = 3;

std::string sentence(const Finding& finding) {
  const std::string places = placesText(finding, kPlacesInText);
  return escaped(finding.text) + (places.empty() ? "" : " (" + places + ")");
}

std::string nextLine(FindingKind kind) { return "    next: " + std::string(nextStep(kind)) + "\n"; }

}  // namespace

std::string anatomyText(const InputAnatomy& anatomy) {
  std::string text;
  std::uint64_t doubts = 0;
  for (const CellFindings& cell : anatomy.cells())
    for (const Finding& finding : cell.findings) {
      if (!finding.doubt || ++doubts > kMostDoubts) continue;
      text += "  doubt " + inShort(cell.shown()) + ": " + std::string(name(finding.kind)) + ": " + sentence(finding) +
              "\n" + nextLine(finding.kind);
    }
  if (doubts > kMostDoubts)
    text += "  and " + counted(doubts - kMostDoubts, "more doubt") + "; --report FILE.html shows all\n";
  for (std::size_t i = 0; i < kFindingKinds; ++i) {
    const auto kind = static_cast<FindingKind>(i);
    const std::uint64_t cells = anatomy.count(kind, false);
    if (cells == 0) continue;
    const auto has_it = [&](const Finding& finding) { return finding.kind == kind && !finding.doubt; };
    const auto first = std::find_if(anatomy.cells().begin(), anatomy.cells().end(), [&](const CellFindings& cell) {
      return std::any_of(cell.findings.begin(), cell.findings.end(), has_it);
    });
    const auto finding = std::find_if(first->findings.begin(), first->findings.end(), has_it);
    text += "  note " + std::string(name(kind)) + " " + formatCount(cells) + ": " + std::string(explanation(kind)) +
            " (first: " + inShort(first->shown()) + ": " + sentence(*finding) + ")\n" + nextLine(kind);
  }
  return text;
}

nlohmann::ordered_json anatomyCountsJson(const InputAnatomy& anatomy) {
  nlohmann::ordered_json counts = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < kFindingKinds; ++i) {
    const auto kind = static_cast<FindingKind>(i);
    const std::uint64_t doubts = anatomy.count(kind, true), notes = anatomy.count(kind, false);
    if (doubts + notes > 0) counts[std::string(name(kind))] = {{"doubts", doubts}, {"notes", notes}};
  }
  return counts;
}

nlohmann::ordered_json findingJson(const Finding& finding) {
  nlohmann::ordered_json places = nlohmann::ordered_json::array();
  for (const FindingPlace& place : finding.places) {
    nlohmann::ordered_json one = {{"line", place.line}, {"sample", place.sample}};
    if (place.value_um > 0) one["um"] = place.value_um;
    places.push_back(std::move(one));
  }
  return {{"finding", std::string(name(finding.kind))},
          {"class", finding.doubt ? "doubt" : "note"},
          {"count", finding.count},
          {"text", finding.text},
          {"places", std::move(places)},
          {"next", std::string(nextStep(finding.kind))}};
}

FindingsBySource::FindingsBySource(const std::vector<CellFindings>& cells) {
  for (const CellFindings& cell : cells) by_source_.push_back(&cell);
  std::stable_sort(by_source_.begin(), by_source_.end(),
                   [](const CellFindings* a, const CellFindings* b) { return a->source < b->source; });
}

std::vector<const CellFindings*> FindingsBySource::exactly(const std::string& source, std::uint64_t digest) const {
  std::vector<const CellFindings*> found;
  for (auto at = std::lower_bound(by_source_.begin(), by_source_.end(), source,
                                  [](const CellFindings*cell, const std::string&s) { return cell->source < s; });
       at != by_source_.end() && (*at)->source == source; ++at)
    if ((*at)->digest == digest) found.push_back(*at);
  return found;
}

std::vector<const CellFindings*> FindingsBySource::of(const SourceReport& row) const {
  if (!row.archive) return exactly(row.file, row.digest);
  std::vector<const CellFindings*> found;
  for (const EntryReport& entry : row.entries) {
    const std::vector<const CellFindings*> its = of(row, entry);
    found.insert(found.end(), its.begin(), its.end());
  }
  return found;
}

std::vector<const CellFindings*> FindingsBySource::of(const SourceReport& row, const EntryReport& entry) const {
  return exactly(row.file + "/" + entry.shown_label(), entry.digest);
}

namespace {

// The names of the doubts about the first cell that has any; empty if none has.
std::string firstDoubts(const std::vector<const CellFindings*>& cells) {
  std::string names;
  for (const CellFindings* cell : cells) {
    for (const Finding& finding : cell->findings)
      if (finding.doubt) names += (names.empty() ? "" : ", ") + std::string(name(finding.kind));
    if (!names.empty()) break;
  }
  return names;
}

void refuseFor(InputReport& report, const std::string& doubts) {
  report.severity = Severity::kRefuse;
  report.doubts = doubts;
  report.samples = report.segments = report.isolated = report.roots = 0;
}

}  // namespace

void refuseDoubtful(std::vector<SourceReport>& reports, const FindingsBySource& findings) {
  for (SourceReport& row : reports) {
    const std::string doubts = firstDoubts(findings.of(row));
    if (doubts.empty()) continue;
    if (!row.archive) {
      refuseFor(row.report, doubts);
      continue;
    }
    row.report.severity = Severity::kRefuse;
    row.report.doubts = doubts;
    for (EntryReport& entry : row.entries) {
      const std::string its = firstDoubts(findings.of(row, entry));
      if (entry.dropped || its.empty()) continue;
      row.report.samples -= entry.report.samples;
      row.report.segments -= entry.report.segments;
      row.report.isolated -= entry.report.isolated;
      row.report.roots -= entry.report.roots;
      entry.dropped = true;
      refuseFor(entry.report, its);
    }
  }
}

}  // namespace filiform::tools
