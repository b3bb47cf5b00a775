#include "index/levels/internal/level_somata.h"

#include "index/cell/soma.h"

#include <algorithm>
#include <span>
#include <tuple>
#include <utility>

namespace filiform::internal {
namespace {

constexpr float kThickestBall_um = 30;  // a larger radius of a soma is an error
constexpr double kBallMargin = 1.02;    // a sample of a soma lies within this part of its radius

// Removes the segments between samples inside the somata of their cells, which are ascending by cell. `isolated`: also
// balls.
void removeInside(Neurites& neurites, std::span<const SomaRoot> somata, const Grid& grid, bool isolated) {
  std::vector<std::uint8_t> kept;
  for (const NeuritePath& path : neurites.paths) {
    for (std::uint32_t k = path.isBall() && isolated ? 0 : 1; k < path.count; ++k) {
      const NeuritePoint* end = neurites.points.data() + path.begin + k;
      const NeuritePoint* start = path.isBall() ? end : end - 1;
      if (end->type != kSomaType) continue;
      const auto first = std::ranges::lower_bound(somata, path.cell, {}, &SomaRoot::cell);
      const auto last = std::ranges::upper_bound(somata, path.cell, {}, &SomaRoot::cell);
      const bool inside = std::any_of(first, last, [&](const SomaRoot& soma) {
        const double reach = kBallMargin * static_cast<double>(soma.radius_um) / grid.quantum_um();
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

}  // namespace

LevelSomata::LevelSomata(std::vector<SomaRoot> somata, const Grid& grid) : grid_(grid), by_place_(std::move(somata)) {
  std::sort(by_place_.begin(), by_place_.end(), [](const SomaRoot& a, const SomaRoot& b) {
    const MortonKey x = mortonKey(a.p), y = mortonKey(b.p);
    return std::tie(x, a.cell, a.sample) < std::tie(y, b.cell, b.sample);
  });
}

std::vector<SomaRoot> LevelSomata::within(const BlockKey& block) const {
  const auto first = std::lower_bound(by_place_.begin(), by_place_.end(), block.low,
                                      [](const SomaRoot& root, MortonKey low) { return mortonKey(root.p) < low; });
  std::vector<SomaRoot> here;
  for (auto soma = first; soma != by_place_.end() && block.contains(mortonKey(soma->p)); ++soma) here.push_back(*soma);
  std::sort(here.begin(), here.end(), [](const SomaRoot& a, const SomaRoot& b) {
    return std::tie(a.cell, a.sample) < std::tie(b.cell, b.sample);
  });
  return here;
}

void LevelSomata::apply(Neurites& neurites, const BlockKey& leaf) const {
  const std::vector<SomaRoot> here = within(leaf);
  if (here.empty()) return;
  removeInside(neurites, here, grid_, true);
  for (const SomaRoot& soma : here) {
    neurites.paths.push_back(
        {soma.cell, soma.sample, soma.sample, kNoSample, static_cast<std::uint32_t>(neurites.points.size()), 1});
    neurites.points.push_back({soma.p, soma.radius_um, kSomaType, 0});
  }
}

void removeInsideBalls(Neurites& neurites, std::span<const SomaRoot> balls, const Grid& grid) {
  if (!balls.empty()) removeInside(neurites, balls, grid, false);
}

}  // namespace filiform::internal
