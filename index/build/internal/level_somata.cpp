#include "index/build/internal/level_somata.h"

#include "index/cell/soma.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace filiform::internal {
namespace {

constexpr float kThickestBall_um = 30;  // a larger radius of a soma is an error
constexpr double kBallMargin = 1.02;    // a sample of a soma lies within this part of its radius

}  // namespace

LevelSomata::LevelSomata(std::vector<SomaRoot> somata, const Grid& grid) : grid_(grid), by_cell_(std::move(somata)) {
  std::sort(by_cell_.begin(), by_cell_.end(), [](const SomaRoot& a, const SomaRoot& b) {
    return std::tie(a.cell, a.sample) < std::tie(b.cell, b.sample);
  });
  by_place_ = by_cell_;
  std::stable_sort(by_place_.begin(), by_place_.end(),
                   [](const SomaRoot& a, const SomaRoot& b) { return mortonKey(a.p) < mortonKey(b.p); });
}

void LevelSomata::removeInside(Neurites& neurites) const {
  std::vector<std::uint8_t> kept;
  for (const NeuritePath& path : neurites.paths) {
    for (std::uint32_t k = path.isBall() ? 0 : 1; k < path.count; ++k) {
      const NeuritePoint* end = neurites.points.data() + path.begin + k;
      const NeuritePoint* start = path.isBall() ? end : end - 1;
      if (end->type != kSomaType) continue;
      const auto [first, last] = std::ranges::equal_range(by_cell_, path.cell, {}, &SomaRoot::cell);
      const bool inside = std::any_of(first, last, [&](const SomaRoot& soma) {
        const double reach = kBallMargin * static_cast<double>(soma.radius_um) / grid_.quantum_um();
        return soma.radius_um <= kThickestBall_um && (end->p - soma.p).cast<double>().norm() <= reach &&
               (start->p - soma.p).cast<double>().norm() <= reach;
      });
      if (!inside) continue;
      if (kept.empty()) kept.assign(neurites.points.size(), 1);
      kept[path.begin + k] = 0;
    }
  }
  if (!kept.empty()) cutOut(neurites, kept);
}

void LevelSomata::apply(Neurites& neurites, const BlockKey& leaf) const {
  if (by_cell_.empty()) return;
  removeInside(neurites);
  const auto first = std::lower_bound(by_place_.begin(), by_place_.end(), leaf.low,
                                      [](const SomaRoot& root, MortonKey low) { return mortonKey(root.p) < low; });
  const std::size_t before = neurites.paths.size();
  for (auto soma = first; soma != by_place_.end() && leaf.contains(mortonKey(soma->p)); ++soma) {
    neurites.paths.push_back(
        {soma->cell, soma->sample, soma->sample, kNoSample, static_cast<std::uint32_t>(neurites.points.size()), 1});
    neurites.points.push_back({soma->p, soma->radius_um, kSomaType, 0});
  }
  std::sort(neurites.paths.begin() + static_cast<std::ptrdiff_t>(before), neurites.paths.end(),
            [](const NeuritePath& a, const NeuritePath& b) {
              return std::tie(a.cell, a.first_sample) < std::tie(b.cell, b.first_sample);
            });
}

}  // namespace filiform::internal
