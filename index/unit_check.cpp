#include "index/unit_check.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace filiform {
namespace {

float median(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool isPlausible(double step_um, double extent_um) {
  return step_um >= UnitCheck::kMinSegment_um && step_um <= UnitCheck::kMaxSegment_um &&
         extent_um >= UnitCheck::kMinExtent_um && extent_um <= UnitCheck::kMaxExtent_um;
}

}  // namespace

void UnitCheck::add(const Cell& cell) {
  if (extents_um_.size() == kMaxCells || cell.segmentRanks() < 8) return;
  Vector3d low = cell.positions_um.front(), high = low;
  for (const Vector3d& p : cell.positions_um) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  std::vector<float> steps;
  const std::size_t ranks = cell.segmentRanks(), stride = 1 + ranks / kSegmentsOfACell;
  for (std::size_t s = 0; s < ranks; s += stride) {
    const auto [child, parent] = cell.ends(static_cast<std::uint32_t>(s));
    const double length = (cell.positions_um[child] - cell.positions_um[parent]).norm();
    if (length > 0) steps.push_back(static_cast<float>(length));
  }
  if (steps.empty()) return;
  steps_um_.push_back(median(std::move(steps)));
  extents_um_.push_back(static_cast<float>((high - low).norm()));
}

std::string UnitCheck::doubt(double unit_um) const {
  if (steps_um_.empty()) return {};
  const double step = static_cast<double>(median(steps_um_)), extent = static_cast<double>(median(extents_um_));
  if (isPlausible(step, extent)) return {};
  struct KnownUnit {
    const char* text;
    double um;
  };
  static constexpr std::array<KnownUnit, 5> kCandidates = {{{"nm", 1e-3},
                                                            {"0.008 (voxels of 8 nm)", 0.008},
                                                            {"0.5 (voxels of half a micrometre)", 0.5},
                                                            {"um", 1},
                                                            {"mm", 1e3}}};
  std::string would_do;
  for (const KnownUnit& c : kCandidates)
    if (isPlausible(step * (c.um / unit_um), extent * (c.um / unit_um)))
      would_do += (would_do.empty() ? "" : ", ") + std::string(c.text);
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "the unit looks wrong: a median cell measures %.3g um, its segments %.3g um; ", extent, step);
  return text.data() + (would_do.empty() ? "--unit states the unit of the files" : "--unit may be " + would_do);
}

}  // namespace filiform
