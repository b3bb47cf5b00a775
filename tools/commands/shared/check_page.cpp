#include "tools/commands/shared/check_page.h"

#include "index/cell/soma.h"
#include "index/count_text.h"
#include "index/input/input_outcome.h"
#include "index/text.h"
#include "tools/commands/shared/anatomy_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <ostream>
#include <string_view>
#include <unordered_set>

namespace filiform::tools {
namespace {

constexpr int kWidth = 180, kHeight = 140, kMargin = 4;
constexpr std::uint16_t kAxonCode = 2, kBasalCode = 3, kApicalCode = 4;

constexpr std::string_view kStyle =
    "body{font:14px/1.4 sans-serif;margin:2em;max-width:70em}h1{font-size:1.4em}h2{font-size:1em;margin:0 0 .3em;"
    "overflow-wrap:anywhere}pre{white-space:pre-wrap}section{display:flex;gap:1em;border-top:1px solid "
    "#ccc;padding:.7em "
    "0}section>div{min-width:0}section>.cells{display:flex;flex-wrap:wrap;align-content:flex-start;gap:.3em;flex:none;"
    "max-width:50%}figure{margin:0;width:180px;overflow-wrap:anywhere}svg{background:#fafafa}ul{margin:0;padding-left:"
    "1.2em}.refused,.skipped{color:"
    "#"
    "a00}.doubt{color:#a40}.next{color:#555}path{fill:none;stroke-width:1}.o{stroke:#888}.a{stroke:#06c}.d{stroke:#c22}"
    ".s{stroke:#000;stroke-width:3;stroke-linecap:round}";

std::string html(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

// A path of strokes between points of the raster.
struct Strokes {
  std::string path;
  std::array<int, 2> at{};

  void add(std::array<int, 2> from, std::array<int, 2> to, int scale) {
    if (path.empty() || at != from)
      path += "M" + std::to_string(from[0] * scale) + " " + std::to_string(from[1] * scale);
    path += "l" + std::to_string((to[0] - from[0]) * scale) + " " + std::to_string((to[1] - from[1]) * scale);
    at = to;
  }
};

// The strokes by class: others, axon, dendrite, soma. Returns false if there are too many.
bool draw(const Cell& cell, int scale, std::array<Strokes, 4>& strokes) {
  Vector3d low = cell.positions_um.front(), high = low;
  for (const Vector3d& p : cell.positions_um) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double wide = kWidth - 2 * kMargin, tall = kHeight - 2 * kMargin;
  const double unit = std::max({(high.x() - low.x()) / wide, (high.y() - low.y()) / tall, 1e-9}) * scale;
  const auto on_raster = [&](const Vector3d& p) -> std::array<int, 2> {
    return {static_cast<int>(kMargin / scale + std::floor((p.x() - low.x()) / unit)),
            static_cast<int>(kMargin / scale + std::floor((high.y() - p.y()) / unit))};
  };
  std::unordered_set<std::uint64_t> drawn;
  for (std::uint32_t rank = 0; rank < cell.segmentRanks(); ++rank) {
    const auto [child, parent] = cell.ends(rank);
    if (child == parent) continue;
    const std::array<int, 2> from = on_raster(cell.positions_um[parent]), to = on_raster(cell.positions_um[child]);
    const std::uint16_t type = cell.types[child];
    const std::size_t of = type == kSomaType                           ? 3
                           : type == kAxonCode                         ? 1
                           : type == kBasalCode || type == kApicalCode ? 2
                                                                       : 0;
    if (from == to && of != 3) continue;
    std::uint64_t key = of;
    for (const int value : {from[0], from[1], to[0], to[1]})
      key = key << 12 | static_cast<std::uint64_t>(value & 0xFFF);
    if (!drawn.insert(key).second) continue;
    if (drawn.size() > kMostStrokes) return false;
    strokes[of].add(from, to, scale);
  }
  for (std::uint32_t rank = 0; rank < cell.samples() && strokes[3].path.empty(); ++rank)
    if (cell.types[rank] == kSomaType) {
      const std::array<int, 2> at = on_raster(cell.positions_um[rank]);
      strokes[3].add(at, at, scale);
    }
  return true;
}

struct PageRow {
  std::string name;
  const InputReport* report = nullptr;
  InputOutcome outcome;
  std::vector<const CellFindings*> findings;  // of its cells
  std::span<const CellPictures::Picture> pictures;
  std::array<std::size_t, 3> worth{};
};

// Refused and skipped inputs, then doubts, warnings, notes.
std::array<std::size_t, 3> worthOf(const PageRow& row) {
  std::size_t doubts = 0, notes = 0;
  for (const CellFindings* cell : row.findings)
    for (const Finding& finding : cell->findings) ++(finding.doubt ? doubts : notes);
  const std::size_t base = row.outcome.fate == InputFate::kRefused   ? 4
                           : row.outcome.fate == InputFate::kSkipped ? 3
                           : doubts > 0                              ? 2
                           : row.outcome.fate == InputFate::kWarned  ? 1
                                                                     : 0;
  return {base, doubts, notes};
}

void writeRow(std::ostream& out, const PageRow& row) {
  const std::string fate(name(row.outcome.fate));
  out << "<section>";
  if (!row.pictures.empty()) out << "<div class=cells>";
  for (const CellPictures::Picture& picture : row.pictures)
    out << "<figure>" << picture.svg
        << (picture.name.empty() ? "" : "<figcaption>" + html(escaped(picture.name)) + "</figcaption>") << "</figure>";
  out << (row.pictures.empty() ? "" : "</div>") << "<div><h2>" << html(escaped(row.name)) << "</h2><ul>";
  out << "<li class=" << fate << ">" << fate;
  if (row.outcome.isLost())
    out << ": " << html(escaped(row.outcome.reason)) << (row.outcome.code.empty() ? "" : " (" + row.outcome.code + ")");
  else
    out << ": " << counted(row.report->samples, "sample") << ", " << counted(row.report->segments, "segment");
  if (!row.report->codes.empty() && !row.outcome.isLost())
    for (const auto& [code, count] : row.report->codes.all())
      out << "<li>" << name(code) << " " << formatCount(count) << ": " << html(explanation(code));
  for (const CellFindings* cell : row.findings)
    for (const Finding& finding : cell->findings) {
      const std::string places = placesText(finding, 10);
      out << "<li" << (finding.doubt ? " class=doubt>doubt " : ">note ")
          << (cell->name.empty() ? "" : html(escaped(cell->name)) + ": ") << name(finding.kind) << ": "
          << html(escaped(finding.text)) << (places.empty() ? "" : " (" + places + ")")
          << "<br><span class=next>next: " << html(nextStep(finding.kind)) << "</span>";
    }
  out << "</ul></div></section>\n";
}

}  // namespace

std::string cellPicture(const Cell& cell) {
  if (cell.samples() == 0) return {};
  std::array<Strokes, 4> strokes;
  for (const int scale : {1, 2, 4, 8, 16}) {
    strokes = {};
    if (draw(cell, scale, strokes)) break;
  }
  std::string svg = "<svg width=" + std::to_string(kWidth) + " height=" + std::to_string(kHeight) + ">";
  constexpr std::array<char, 4> kClasses = {'o', 'a', 'd', 's'};
  for (std::size_t i = 0; i < strokes.size(); ++i)
    if (!strokes[i].path.empty()) svg += std::string("<path class=") + kClasses[i] + " d=\"" + strokes[i].path + "\"/>";
  return svg + "</svg>";
}

void CellPictures::add(const Cell& cell, const std::vector<Finding>& findings) {
  double worth = 0;
  for (const Finding& finding : findings) worth += finding.doubt ? 100 : 1;
  const std::uint64_t number = added_++;
  if (worth <= least_worth_) return;
  pictures_[{cell.source, cell.digest}].push_back({cell.name, cellPicture(cell), worth, number});
  if (++held_ > 2 * kMost) discardLeast(kMost);
}

void CellPictures::discardLeast(std::size_t most) {
  std::vector<std::pair<double, std::uint64_t>> order;
  for (const auto& [source, pictures] : pictures_)
    for (const Picture& picture : pictures) order.emplace_back(-picture.worth, picture.number);
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(most), order.end());
  const auto limit = order[most];
  for (auto& [source, pictures] : pictures_)
    std::erase_if(pictures, [&](const Picture& p) { return std::pair(-p.worth, p.number) >= limit; });
  std::erase_if(pictures_, [](const auto& entry) { return entry.second.empty(); });
  held_ = most;
  least_worth_ = -limit.first;
}

std::span<const CellPictures::Picture> CellPictures::of(const std::string& source, std::uint64_t digest) const {
  const auto at = pictures_.find({source, digest});
  if (at == pictures_.end()) return {};
  return at->second;
}

void writeCheckPage(std::ostream& out, const std::string& summary, const std::vector<SourceReport>& reports,
                    const InputAnatomy& anatomy, const CellPictures& pictures) {
  const FindingsBySource findings(anatomy.cells());
  std::vector<PageRow> rows;
  for (const SourceReport& source : reports) {
    const std::optional<InputOutcome> outcome = outcomeOfInput(source);
    if (outcome && source.archive) rows.push_back({source.file, &source.report, *outcome, {}, {}, {}});
    if (outcome && !source.archive)
      rows.push_back(
          {source.file, &source.report, *outcome, findings.of(source), pictures.of(source.file, source.digest), {}});
    for (const EntryReport& entry : source.entries)
      rows.push_back({source.file + "/" + entry.entry,
                      &entry.report,
                      outcomeOfInput(source, entry),
                      findings.of(source, entry),
                      pictures.of(source.file + "/" + entry.shown_label(), entry.digest),
                      {}});
  }
  for (PageRow& row : rows) row.worth = worthOf(row);
  std::stable_sort(rows.begin(), rows.end(), [](const PageRow& a, const PageRow& b) { return a.worth > b.worth; });

  out << "<!DOCTYPE html>\n<html lang=en><meta charset=utf-8>\n<meta http-equiv=Content-Security-Policy "
         "content=\"default-src 'none'; style-src 'unsafe-inline'\">\n<title>filiform check</title>\n<style>"
      << kStyle << "</style>\n<h1>filiform check</h1>\n<pre>" << html(summary) << "</pre>\n";
  for (const PageRow& row : rows) writeRow(out, row);
  out << "</html>\n";
}

}  // namespace filiform::tools
