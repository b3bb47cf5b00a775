#include "index/anatomy/input_anatomy.h"

#include "index/file/internal/bytes.h"
#include "index/file/internal/digest.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string_view>
#include <unordered_map>

namespace filiform {
namespace {

template <class T>
std::uint64_t chained(const std::vector<T>& values, std::uint64_t seed) {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(values.data());
  return internal::checksum(std::span(bytes, values.size() * sizeof(T)), seed);
}

// Of what a copy in another file has too, whatever its ids, header and line ends are.
std::uint64_t contentOf(const Cell& cell) {
  if (cell.samples() < 2) return 0;
  std::uint64_t digest = chained(cell.positions_um, cell.samples());
  digest = cell.isGraph() ? chained(cell.links, digest) : chained(cell.parents, digest);
  return chained(cell.types, chained(cell.radii_um, digest));
}

std::string_view folderOfSource(std::string_view source) {
  const std::size_t slash = source.rfind('/');
  return slash == std::string_view::npos ? std::string_view() : source.substr(0, slash);
}

double medianOf(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

void encodeFinding(const Finding& finding, internal::ByteWriter& out) {
  out.u8(static_cast<std::uint8_t>(finding.kind));
  out.u8(finding.doubt ? 1 : 0);
  out.varint(finding.count);
  out.sizedText(finding.text);
  out.varint(finding.places.size());
  for (const FindingPlace& place : finding.places) {
    out.varint(place.line);
    out.i64(place.sample);
    out.f64(place.value_um);
  }
}

Finding decodeFinding(internal::ByteReader& in) {
  Finding finding;
  finding.kind = static_cast<FindingKind>(in.u8());
  finding.doubt = in.u8() != 0;
  finding.count = in.varint();
  finding.text = in.sizedText();
  for (std::uint64_t n = in.varint(); n > 0; --n) {
    FindingPlace place;
    place.line = in.varint();
    place.sample = in.i64();
    place.value_um = in.f64();
    finding.places.push_back(place);
  }
  return finding;
}

}  // namespace

bool CellFindings::anyDoubt() const {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& finding) { return finding.doubt; });
}

const std::vector<Finding>& InputAnatomy::add(const Cell& cell) {
  const std::vector<Finding>& findings = check_.of(cell);
  measures_.push_back({cell.source, cell.name, cell.digest, contentOf(cell), static_cast<float>(check_.median_um()),
                       static_cast<float>(check_.extent_um()), false});
  for (const Finding& finding : findings) measures_.back().flat |= finding.kind == FindingKind::kFlatZ;
  if (!findings.empty()) {
    cells_.push_back({cell.source, cell.name, findings, cell.digest});
    measure_of_.push_back(static_cast<std::uint32_t>(measures_.size() - 1));
  }
  return findings;
}

std::vector<std::uint8_t> InputAnatomy::encode() const {
  internal::ByteWriter out;
  std::size_t at = 0;
  for (std::size_t i = 0; i < measures_.size(); ++i) {
    out.sizedText(measures_[i].source);
    out.sizedText(measures_[i].name);
    out.u64(measures_[i].digest);
    out.u64(measures_[i].content);
    out.f32(measures_[i].step_um);
    out.f32(measures_[i].extent_um);
    out.u8(measures_[i].flat ? 1 : 0);
    const bool has_findings = at < cells_.size() && measure_of_[at] == i;
    out.varint(has_findings ? cells_[at].findings.size() : 0);
    if (!has_findings) continue;
    for (const Finding& finding : cells_[at].findings) encodeFinding(finding, out);
    ++at;
  }
  return out.take();
}

void InputAnatomy::take(std::span<const std::uint8_t> bytes) {
  internal::ByteReader in(bytes);
  while (in.left() > 0) {
    Measure measure;
    measure.source = in.sizedText();
    measure.name = in.sizedText();
    measure.digest = in.u64();
    measure.content = in.u64();
    measure.step_um = in.f32();
    measure.extent_um = in.f32();
    measure.flat = in.u8() != 0;
    CellFindings cell{measure.source, measure.name, {}, measure.digest};
    for (std::uint64_t n = in.varint(); n > 0; --n) cell.findings.push_back(decodeFinding(in));
    measures_.push_back(std::move(measure));
    if (cell.findings.empty()) continue;
    cells_.push_back(std::move(cell));
    measure_of_.push_back(static_cast<std::uint32_t>(measures_.size() - 1));
  }
}

Finding& InputAnatomy::findingAt(std::size_t measure, FindingKind kind) {
  compared_.emplace_back(static_cast<std::uint32_t>(measure), Finding{});
  Finding& finding = compared_.back().second;
  finding.kind = kind;
  finding.doubt = true;
  return finding;
}

void InputAnatomy::findOtherUnits() {
  struct Sizes {
    std::vector<float> steps_um, extents_um;
    double step_um = 0, extent_um = 0;
  };
  Sizes all;
  std::map<std::string_view, Sizes> folders;
  for (const Measure& measure : measures_) {
    if (!(measure.step_um > 0)) continue;
    for (Sizes* const sizes : {&all, &folders[folderOfSource(measure.source)]}) {
      sizes->steps_um.push_back(measure.step_um);
      sizes->extents_um.push_back(measure.extent_um);
    }
  }
  const auto close = [](Sizes& sizes) {
    if (sizes.steps_um.size() < kLeastCells) return;
    sizes.step_um = medianOf(std::move(sizes.steps_um));
    sizes.extent_um = medianOf(std::move(sizes.extents_um));
  };
  close(all);
  for (auto& [folder, sizes] : folders) close(sizes);
  for (std::size_t i = 0; i < measures_.size(); ++i) {
    const Measure& measure = measures_[i];
    if (!(measure.step_um > 0)) continue;
    const Sizes& folder = folders[folderOfSource(measure.source)];
    const Sizes& others = folder.step_um > 0 ? folder : all;
    if (!(others.step_um > 0)) continue;
    const double step = static_cast<double>(measure.step_um) / others.step_um,
                 extent = static_cast<double>(measure.extent_um) / others.extent_um, mean = std::sqrt(step * extent);
    const bool larger = step > kOtherSize && extent > kOtherSize && mean > kOtherScale;
    const bool smaller = step < 1 / kOtherSize && extent < 1 / kOtherSize && mean < 1 / kOtherScale;
    if (!larger && !smaller) continue;
    char text[200];
    std::snprintf(text, sizeof text,
                  "about %.0f times %s than the %s: it extends over %.4g um, the median cell over %.4g um",
                  larger ? mean : 1 / mean, larger ? "larger" : "smaller",
                  &others == &all ? "other cells" : "cells of its folder", static_cast<double>(measure.extent_um),
                  others.extent_um);
    findingAt(i, FindingKind::kOtherUnit).text = text;
  }
}

void InputAnatomy::excuseFlatFolders() {
  struct Count {
    std::uint64_t cells = 0, flat = 0;
  };
  std::map<std::string_view, Count> folders;
  for (const Measure& measure : measures_) {
    Count& count = folders[folderOfSource(measure.source)];
    ++count.cells;
    count.flat += measure.flat;
  }
  for (CellFindings& cell : cells_)
    for (Finding& finding : cell.findings) {
      if (finding.kind != FindingKind::kFlatZ || !finding.doubt) continue;
      const Count& count = folders[folderOfSource(cell.source)];
      if (count.cells < kLeastCells || 2 * count.flat <= count.cells) continue;
      finding.doubt = false;
      finding.text += ", as in most cells of its folder";
    }
}

void InputAnatomy::findDuplicates() {
  std::unordered_map<std::uint64_t, std::uint32_t> first;
  for (std::size_t i = 0; i < measures_.size(); ++i) {
    if (measures_[i].content == 0) continue;
    const auto [at, is_first] = first.try_emplace(measures_[i].content, static_cast<std::uint32_t>(i));
    if (is_first) continue;
    const Measure& earlier = measures_[at->second];
    findingAt(i, FindingKind::kDuplicate).text =
        "the same samples and links as " + inShort(CellFindings{earlier.source, earlier.name, {}}.shown());
  }
}

void InputAnatomy::finish() {
  findOtherUnits();
  excuseFlatFolders();
  findDuplicates();
  std::stable_sort(compared_.begin(), compared_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<CellFindings> merged;
  std::size_t next = 0;
  const auto open = [&](std::uint32_t measure) {
    for (; next < cells_.size() && measure_of_[next] < measure; ++next) merged.push_back(std::move(cells_[next]));
    if (next < cells_.size() && measure_of_[next] == measure) {
      merged.push_back(std::move(cells_[next++]));
    } else {
      merged.push_back({measures_[measure].source, measures_[measure].name, {}, measures_[measure].digest});
    }
  };
  for (std::size_t i = 0; i < compared_.size(); ++i) {
    auto& [measure, finding] = compared_[i];
    if (i == 0 || compared_[i - 1].first != measure) open(measure);
    merged.back().findings.push_back(std::move(finding));
  }
  for (; next < cells_.size(); ++next) merged.push_back(std::move(cells_[next]));
  for (CellFindings& cell : merged)
    std::stable_sort(cell.findings.begin(), cell.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.kind < b.kind; });
  cells_ = std::move(merged);
  compared_.clear();
  measures_.clear();
  measure_of_.clear();
}

std::uint64_t InputAnatomy::doubts() const {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < kFindingKinds; ++i) sum += count(static_cast<FindingKind>(i), true);
  return sum;
}

std::uint64_t InputAnatomy::count(FindingKind kind, bool doubt) const {
  return static_cast<std::uint64_t>(std::count_if(cells_.begin(), cells_.end(), [&](const CellFindings& cell) {
    return std::any_of(cell.findings.begin(), cell.findings.end(),
                       [&](const Finding& finding) { return finding.kind == kind && finding.doubt == doubt; });
  }));
}

}  // namespace filiform
