#include "index/cell/soma.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace filiform {
namespace {

constexpr std::size_t kLeastOutline = 4;
// Largest gap between the ends, as a fraction of the outline's length. A straight run has 0.5.
constexpr double kWidestGap = 0.3;
constexpr double kMostSpread =
    0.45;  // deviation of the distances from the centre, relative to their mean; flat runs have 0.58
constexpr double kThickestOutline = 0.5;  // relative to the outline's radius; thicker runs are cylinders

bool isThreeSamples(std::span<const SomaSample> s) { return s.size() == 3 && s[1].parent == 0 && s[2].parent == 0; }

// The samples from the root to the end of an unbranched run; empty if they branch.
std::vector<std::uint32_t> unbranchedRun(std::span<const SomaSample> samples) {
  constexpr std::uint32_t kNoSample = UINT32_MAX;
  std::vector<std::uint32_t> next(samples.size(), kNoSample), run;
  for (std::uint32_t i = 1; i < samples.size(); ++i) {
    if (next[samples[i].parent] != kNoSample) return {};
    next[samples[i].parent] = i;
  }
  for (std::uint32_t at = 0; at != kNoSample; at = next[at]) run.push_back(at);
  return run;
}

struct Ball {
  Vector3d centre_um;
  double radius_um;
};

std::optional<Ball> outlineOf(std::span<const SomaSample> samples) {
  if (samples.size() < kLeastOutline) return std::nullopt;
  const std::vector<std::uint32_t> run = unbranchedRun(samples);
  if (run.empty()) return std::nullopt;
  const double gap_um = (samples[run.front()].p_um - samples[run.back()].p_um).norm();
  double around_um = gap_um;
  Vector3d centre = Vector3d::Zero();
  for (std::size_t i = 0; i < run.size(); ++i) {
    if (i > 0) around_um += (samples[run[i]].p_um - samples[run[i - 1]].p_um).norm();
    centre += samples[run[i]].p_um / static_cast<double>(run.size());
  }
  if (gap_um > kWidestGap * around_um) return std::nullopt;
  double sum = 0, squares = 0, thickest = 0;
  for (const SomaSample& sample : samples) {
    const double distance = (sample.p_um - centre).norm();
    sum += distance;
    squares += distance * distance;
    if (std::isfinite(sample.radius_um)) thickest = std::max(thickest, static_cast<double>(sample.radius_um));
  }
  const double n = static_cast<double>(samples.size()), mean = sum / n;
  const double spread = std::sqrt(std::max(0.0, squares / n - mean * mean));
  if (!(mean > 0) || spread > kMostSpread * mean || thickest > kThickestOutline * mean) return std::nullopt;
  return Ball{centre, mean};
}

void listSamples(std::span<const SomaSample> samples, Soma& soma) {
  std::vector<bool> leads_on(samples.size(), false);
  for (std::size_t i = samples.size(); i-- > 1;) {  // parents come before their children
    leads_on[i] = leads_on[i] || samples[i].has_neurite;
    if (leads_on[i]) leads_on[samples[i].parent] = true;
  }
  for (std::size_t i = 1; i < samples.size(); ++i) {
    soma.samples.push_back(samples[i].rank);
    if (!leads_on[i]) soma.dead_ends.push_back(samples[i].rank);
  }
  std::sort(soma.samples.begin(), soma.samples.end());
  std::sort(soma.dead_ends.begin(), soma.dead_ends.end());
}

}  // namespace

bool Soma::isDeadEnd(std::uint32_t rank) const { return std::binary_search(dead_ends.begin(), dead_ends.end(), rank); }

ThreePoint threePointOf(std::span<const SomaSample> samples, double slack_um) {
  if (!isThreeSamples(samples)) return ThreePoint::kNo;
  const double radius_um = static_cast<double>(samples[0].radius_um);
  const Vector3d a = samples[1].p_um - samples[0].p_um, b = samples[2].p_um - samples[0].p_um;
  const double across_um = (a - b).norm();
  if (!(radius_um > 0) || !std::isfinite(radius_um) || !(across_um > 0)) return ThreePoint::kOff;
  const Vector3d out = (a - b) / across_um * radius_um;
  const double off_um = std::max((a - out).norm(), (b + out).norm());
  // A distance equal to the tolerance counts as within, despite rounding.
  const double most_um = kThreePointTolerance * radius_um * (1 + 1e-6) + 2 * slack_um;
  return off_um <= most_um ? ThreePoint::kYes : ThreePoint::kOff;
}

std::optional<Soma> somaOf(std::span<const SomaSample> samples, double slack_um) {
  if (samples.size() < 3 || samples.size() > kMostSomaSamples) return std::nullopt;
  Soma soma;
  soma.root = samples[0].rank;
  if (threePointOf(samples, slack_um) == ThreePoint::kYes) {
    soma.form = Soma::Form::kThreePoint;
    soma.centre_um = samples[0].p_um;
    soma.radius_um = static_cast<double>(samples[0].radius_um);
  } else if (const std::optional<Ball> ball = outlineOf(samples)) {
    soma.form = Soma::Form::kContour;
    soma.centre_um = ball->centre_um;
    soma.radius_um = ball->radius_um;
  } else {
    return std::nullopt;
  }
  listSamples(samples, soma);
  return soma;
}

CellSomata somataOf(std::span<const std::uint32_t> parents,
                    const std::function<Vector3d(std::uint32_t rank)>& position_um, std::span<const float> radii_um,
                    std::span<const std::uint16_t> types, double slack_um) {
  CellSomata found;
  std::vector<std::uint32_t> roots;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> links;  // parent, child: both of type 1
  std::vector<bool> has_neurite;
  for (std::uint32_t i = 0; i < parents.size(); ++i) {
    const std::uint32_t parent = parents[i];
    if (types[i] == kSomaType && parent == kNoParent) {
      roots.push_back(i);
    } else if (types[i] == kSomaType && types[parent] == kSomaType) {
      links.emplace_back(parent, i);
    }
  }
  if (roots.empty() || links.empty()) return found;
  std::sort(links.begin(), links.end());
  has_neurite.assign(parents.size(), false);
  for (std::uint32_t i = 0; i < parents.size(); ++i)
    if (types[i] != kSomaType && parents[i] != kNoParent) has_neurite[parents[i]] = true;

  std::vector<SomaSample> samples;
  for (const std::uint32_t root : roots) {
    const auto sample = [&](std::uint32_t rank, std::uint32_t parent) {
      return SomaSample{rank, parent, position_um(rank), radii_um[rank], has_neurite[rank]};
    };
    samples.assign(1, sample(root, 0));
    for (std::uint32_t at = 0; at < samples.size() && samples.size() <= kMostSomaSamples; ++at) {
      const std::pair<std::uint32_t, std::uint32_t> first{samples[at].rank, 0};
      for (auto link = std::lower_bound(links.begin(), links.end(), first);
           link != links.end() && link->first == first.first; ++link)
        samples.push_back(sample(link->second, at));
    }
    if (threePointOf(samples, slack_um) == ThreePoint::kOff) found.off_roots.push_back(root);
    if (std::optional<Soma> soma = somaOf(samples, slack_um)) found.somata.push_back(std::move(*soma));
  }
  return found;
}

CellSomata somataOf(const Cell& cell) {
  if (cell.isGraph()) return {};
  return somataOf(
      cell.parents, [&cell](std::uint32_t rank) { return cell.positions_um[rank]; }, cell.radii_um, cell.types);
}

}  // namespace filiform
