#include "index/cell/internal/unit_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace filiform {
namespace {

float median(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool isInRange(double step_um, double extent_um) {
  return step_um >= UnitCheck::kMinSegment_um && step_um <= UnitCheck::kMaxSegment_um &&
         extent_um >= UnitCheck::kMinExtent_um && extent_um <= UnitCheck::kMaxExtent_um;
}

bool isPlausible(double step_um, double extent_um) {
  return isInRange(step_um, extent_um) &&
         (step_um <= UnitCheck::kLongSegment_um || extent_um <= UnitCheck::kLargeExtent_um);
}

// Distance from an ordinary neuron, in powers of ten.
double oddity(double step_um, double extent_um) {
  return std::abs(std::log10(step_um / 1.5)) + std::abs(std::log10(extent_um / 500));
}

}  // namespace

void UnitCheck::add(const Cell& cell) {
  if (sizes_.size() == kMaxCells || cell.segmentRanks() < 8) return;
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
  add({static_cast<float>((high - low).norm()), median(std::move(steps))});
}

void UnitCheck::add(const Sizes& cell) {
  if (sizes_.size() < kMaxCells) sizes_.push_back(cell);
}

std::string UnitCheck::doubt(double unit_um) const {
  if (sizes_.empty()) return {};
  std::vector<float> steps, extents;
  for (const Sizes& cell : sizes_) steps.push_back(cell.step_um), extents.push_back(cell.extent_um);
  const auto step = static_cast<double>(median(std::move(steps))),
             extent = static_cast<double>(median(std::move(extents)));
  // With a stated unit, a coarse tracing of a large cell is no sign of voxels.
  const bool stated = unit_um != 1;
  if (stated ? isInRange(step, extent) : isPlausible(step, extent)) return {};
  struct KnownUnit {
    const char* text;
    double um;
    double rarity;  // voxel sizes rank after equally plausible plain units
  };
  static constexpr std::array<KnownUnit, 5> kKnown = {
      {{"nm", 1e-3, 0}, {"8nm", 0.008, 0.3}, {"0.5um", 0.5, 0.3}, {"um", 1, 0}, {"mm", 1e3, 0}}};
  constexpr double kWithin = 2;  // limit of distance from the likeliest, in powers of ten
  std::vector<std::pair<double, const char*>> likely;
  for (const KnownUnit& unit : kKnown) {
    const double its_step = step * (unit.um / unit_um), its_extent = extent * (unit.um / unit_um);
    if (isPlausible(its_step, its_extent)) likely.emplace_back(oddity(its_step, its_extent) + unit.rarity, unit.text);
  }
  std::stable_sort(likely.begin(), likely.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string would_do;
  for (const auto& [odd, unit] : likely)
    if (odd <= likely.front().first + kWithin) would_do += (would_do.empty() ? "" : " or ") + std::string(unit);
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "the unit looks wrong: a median cell measures %.3g um, its segments %.3g um; ", extent, step);
  if (!would_do.empty()) return text.data() + ("try filiform ingest --unit " + would_do);
  return text.data() + std::string(stated ? "check the unit that --unit states"
                                          : "state the unit of the files: filiform ingest --unit UNIT");
}

}  // namespace filiform
