#include "index/anatomy/anatomy_check.h"

#include "index/cell/soma.h"
#include "index/count_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

namespace filiform {
namespace {

constexpr float kNoLength = -1;
constexpr std::size_t kMostSomaCompared = 64, kMostAxonsCompared = 4096;  // compared with each other
constexpr std::uint16_t kUndefined = 0, kAxon = 2;

std::string formatted(const char* form, auto... values) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), form, values...);
  return text.data();
}

FindingPlace findingPlace(const Cell& cell, std::uint32_t rank, double value_um = 0) {
  return {cell.line(rank), cell.sample_ids[rank], value_um};
}

// Keeps the places with the largest values, in descending order; equal values by rank.
class Largest {
 public:
  void offer(double value_um, std::uint32_t rank) {
    if (found_.size() == Finding::kMostPlaces && value_um <= found_.back().first) return;
    const auto after = std::upper_bound(found_.begin(), found_.end(), value_um,
                                        [](double value, const auto& other) { return value > other.first; });
    found_.insert(after, {value_um, rank});
    if (found_.size() > Finding::kMostPlaces) found_.pop_back();
  }
  std::vector<FindingPlace> places(const Cell& cell) const {
    std::vector<FindingPlace> places;
    for (const auto& [value_um, rank] : found_) places.push_back(findingPlace(cell, rank, value_um));
    return places;
  }

 private:
  std::vector<std::pair<double, std::uint32_t>> found_;
};

bool isSoma(const Cell& cell, std::uint32_t rank) { return cell.types[rank] == kSomaType; }

// From the surface of the soma sample, if `soma` is one and `other` is none.
double outsideSoma(const Cell& cell, std::uint32_t soma, std::uint32_t other, double length_um) {
  if (!isSoma(cell, soma) || isSoma(cell, other)) return length_um;
  const auto radius_um = static_cast<double>(cell.radii_um[soma]);
  return std::isfinite(radius_um) ? std::max(0.0, length_um - radius_um) : length_um;
}

}  // namespace

Finding& AnatomyCheck::add(FindingKind kind, bool doubt, std::uint64_t count) {
  Finding& finding = findings_.emplace_back();
  finding.kind = kind;
  finding.doubt = doubt;
  finding.count = count;
  return finding;
}

const std::vector<Finding>& AnatomyCheck::of(const Cell& cell) {
  findings_.clear();
  median_um_ = extent_um_ = length_um_ = 0;
  if (cell.samples() == 0) return findings_;
  if (lengths_um_.capacity() > Cell::kSamplesKept && cell.segmentRanks() <= Cell::kSamplesKept) {
    lengths_um_ = {};
    sorted_um_ = {};
    tree_ = {};
    children_ = {};
  }
  measureLinks(cell);
  findLongLinks(cell);
  findShape(cell);
  findTrees(cell);
  findTypes(cell);
  findFarAxons(cell);
  findTurns(cell);
  findRadii(cell);
  std::stable_sort(findings_.begin(), findings_.end(),
                   [](const Finding& a, const Finding& b) { return a.kind < b.kind; });
  return findings_;
}

void AnatomyCheck::measureLinks(const Cell& cell) {
  low_um_ = high_um_ = cell.positions_um.front();
  for (const Vector3d& p : cell.positions_um) {
    low_um_ = low_um_.cwiseMin(p);
    high_um_ = high_um_.cwiseMax(p);
  }
  extent_um_ = (high_um_ - low_um_).norm();
  const std::size_t ranks = cell.segmentRanks();
  lengths_um_.assign(ranks, kNoLength);
  children_.assign(cell.isGraph() ? 0 : cell.samples(), 0);
  sorted_um_.clear();
  along_um_ = Vector3d::Zero();
  std::uint64_t zero = 0;
  std::vector<FindingPlace> zero_places;
  for (std::uint32_t rank = 0; rank < ranks; ++rank) {
    const auto [child, parent] = cell.ends(rank);
    if (child == parent) continue;
    if (!children_.empty() && children_[parent] < 2) ++children_[parent];
    const Vector3d step = cell.positions_um[child] - cell.positions_um[parent];
    const double straight_um = step.norm();
    if (straight_um == 0) {
      if (zero++ < Finding::kMostPlaces) zero_places.push_back(findingPlace(cell, child));
      lengths_um_[rank] = 0;
      continue;
    }
    if (isSoma(cell, child) && isSoma(cell, parent)) continue;
    along_um_ += step.cwiseAbs();
    const double um = outsideSoma(cell, parent, child, outsideSoma(cell, child, parent, straight_um));
    lengths_um_[rank] = static_cast<float>(um);
    length_um_ += um;
    if (um > 0) sorted_um_.push_back(static_cast<float>(um));
  }
  if (sorted_um_.size() >= kLeastLinks) {
    const auto middle = sorted_um_.begin() + static_cast<std::ptrdiff_t>((sorted_um_.size() - 1) / 2);
    std::nth_element(sorted_um_.begin(), middle, sorted_um_.end());
    median_um_ = static_cast<double>(*middle);
  }
  if (zero == 0) return;
  Finding& finding = add(FindingKind::kZeroLength, false, zero);
  finding.places = std::move(zero_places);
  finding.text = counted(zero, "link") + " between equal positions";
}

std::vector<std::uint32_t> AnatomyCheck::longLinks() const {
  std::vector<std::uint32_t> ranks;
  if (!(median_um_ > 0)) return ranks;
  const auto limit = static_cast<float>(kLongLink * median_um_);
  for (std::uint32_t rank = 0; rank < lengths_um_.size(); ++rank)
    if (lengths_um_[rank] > limit) ranks.push_back(rank);
  return ranks;
}

void AnatomyCheck::findLongLinks(const Cell& cell) {
  const std::vector<std::uint32_t> ranks = longLinks();
  if (ranks.empty()) return;
  Largest largest;
  double sum_um = 0, longest_um = 0;
  for (const std::uint32_t rank : ranks) {
    const auto um = static_cast<double>(lengths_um_[rank]);
    sum_um += um;
    longest_um = std::max(longest_um, um);
    largest.offer(um, cell.ends(rank)[0]);
  }
  const bool doubt = longest_um > kLongLink_um || sum_um > kLongShare * length_um_;
  Finding& finding = add(FindingKind::kLongLinks, doubt, ranks.size());
  finding.places = largest.places(cell);
  finding.text =
      counted(ranks.size(), "link") +
      formatted(" longer than 20 times the median of %.3g um: %.4g um of %.5g um", median_um_, sum_um, length_um_);
}

void AnatomyCheck::findShape(const Cell& cell) {
  const Vector3d size = high_um_ - low_um_;
  if (cell.samples() < kLeastLinks || !(std::min(size.x(), size.y()) > 0)) return;
  if (size.z() == 0) {
    const bool is_long = std::min(size.x(), size.y()) > kLongPlane_um;
    if (!is_long && cell.samples() < kLeastFlat) return;
    add(FindingKind::kFlatZ, is_long, 0).text = formatted(
        "z is %.6g um everywhere, while x and y extend over %.4g um and %.4g um", low_um_.z(), size.x(), size.y());
    return;
  }
  if (sorted_um_.size() < kLeastLinks) return;
  const double path = along_um_.z(), most = std::max(along_um_.x(), along_um_.y()),
               least = std::min(along_um_.x(), along_um_.y());
  const bool stretched = path > kZStretch * most && size.z() > kZStretch * std::max(size.x(), size.y());
  const bool squashed = path < kZSquash * least && size.z() < kZSquash * std::min(size.x(), size.y());
  if (!stretched && !squashed) return;
  add(FindingKind::kZScale, false, 0).text =
      formatted("z extends over %.4g um, x and y over %.4g um and %.4g um", size.z(), size.x(), size.y());
}

// A tree is a set of linked samples.
void AnatomyCheck::findTrees(const Cell& cell) {
  std::vector<std::uint32_t> roots;  // the first kMostPlaces + 1
  std::uint64_t trees = 0;
  const auto root = [&](std::uint32_t rank) {
    if (trees++ <= Finding::kMostPlaces) roots.push_back(rank);
  };
  if (cell.isGraph()) {
    std::vector<bool> is_child(cell.samples());
    for (const auto& [child, parent] : cell.links)
      if (child != parent) is_child[child] = true;
    for (std::uint32_t rank = 0; rank < cell.samples(); ++rank)
      if (!is_child[rank]) root(rank);
    if (trees > 1) {
      Finding& finding = add(FindingKind::kLooseTrees, false, trees - 1);
      finding.text = counted(trees, "tree") + " that no link joins";
      for (std::size_t i = 1; i < std::min(roots.size(), Finding::kMostPlaces + 1); ++i)
        finding.places.push_back(findingPlace(cell, roots[i]));
    }
    return;
  }
  std::uint64_t somata = 0, soma_samples = 0;
  std::vector<FindingPlace> soma_places;
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    const std::uint32_t parent = cell.parents[rank];
    trees += parent == kNoParent;
    if (!isSoma(cell, rank)) continue;
    ++soma_samples;
    if (parent != kNoParent && isSoma(cell, parent)) continue;
    if (somata++ < Finding::kMostPlaces) soma_places.push_back(findingPlace(cell, rank));
  }
  if (soma_samples == 0) add(FindingKind::kNoSoma, false, 0).text = "no sample of type 1";
  if (somata > 1) {
    Finding& finding = add(FindingKind::kSeveralSomata, false, somata);
    finding.places = std::move(soma_places);
    finding.text = counted(somata, "soma", "somata");
  }
  if (trees < 2) return;
  // The root of each sample, by walks that end at a known one.
  tree_.assign(cell.samples(), kNoParent);
  std::vector<std::uint32_t> walk;
  std::vector<bool> has_soma(cell.samples());
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    std::uint32_t at = rank;
    for (; tree_[at] == kNoParent && cell.parents[at] != kNoParent; at = cell.parents[at]) walk.push_back(at);
    const std::uint32_t its = tree_[at] == kNoParent ? at : tree_[at];
    tree_[at] = its;
    for (const std::uint32_t on : walk) tree_[on] = its;
    walk.clear();
    if (isSoma(cell, rank)) has_soma[its] = true;
  }
  std::uint64_t loose = 0;
  std::vector<FindingPlace> places;
  bool first = true;
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    if (cell.parents[rank] != kNoParent || has_soma[rank]) continue;
    if (soma_samples == 0 && std::exchange(first, false)) continue;  // the rest is loose from the first tree
    if (loose++ < Finding::kMostPlaces) places.push_back(findingPlace(cell, rank));
  }
  if (loose == 0) return;
  Finding& finding = add(FindingKind::kLooseTrees, false, loose);
  finding.places = std::move(places);
  finding.text = counted(loose, "tree") + " that no link joins to the " + (soma_samples > 0 ? "soma" : "first tree");
}

void AnatomyCheck::findTypes(const Cell& cell) {
  if (cell.samples() < kLeastLinks) return;
  bool any_soma = false, one = true, undefined = true, any_other = false;
  for (const std::uint16_t type : cell.types) {
    any_soma = any_soma || type == kSomaType;
    one = one && type == cell.types.front();
    if (type == kSomaType) continue;
    any_other = true;
    undefined = undefined && type == kUndefined;
  }
  if (one)
    add(FindingKind::kOneType, false, 0).text = "all samples have type " + std::to_string(cell.types.front());
  else if (any_soma && any_other && undefined)
    add(FindingKind::kOneType, false, 0).text = "all samples beside the soma have type 0";
}

void AnatomyCheck::findFarAxons(const Cell& cell) {
  if (cell.isGraph()) return;
  std::vector<std::uint32_t> starts, soma;
  std::size_t soma_samples = 0, stride = 1;
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    const std::uint32_t parent = cell.parents[rank];
    if (cell.types[rank] == kAxon && (parent == kNoParent || cell.types[parent] != kAxon) &&
        starts.size() < kMostAxonsCompared)
      starts.push_back(rank);
    if (!isSoma(cell, rank) || soma_samples++ % stride != 0) continue;
    soma.push_back(rank);
    if (soma.size() < kMostSomaCompared) continue;
    for (std::size_t i = 0; i < kMostSomaCompared / 2; ++i) soma[i] = soma[2 * i];
    soma.resize(kMostSomaCompared / 2);
    stride *= 2;
  }
  if (soma.empty() || starts.empty()) return;
  Largest largest;
  std::uint64_t far = 0;
  for (const std::uint32_t start : starts) {
    double nearest_um = std::numeric_limits<double>::infinity();
    for (const std::uint32_t s : soma)
      nearest_um =
          std::min(nearest_um, outsideSoma(cell, s, start, (cell.positions_um[start] - cell.positions_um[s]).norm()));
    if (nearest_um <= kFarAxon_um) continue;
    ++far;
    largest.offer(nearest_um, start);
  }
  if (far == 0) return;
  Finding& finding = add(FindingKind::kFarAxon, false, far);
  finding.places = largest.places(cell);
  finding.text = counted(far, "axon begins", "axons begin") + " more than 100 um from the soma";
}

void AnatomyCheck::findTurns(const Cell& cell) {
  if (cell.isGraph()) return;
  std::uint64_t turns = 0;
  std::vector<FindingPlace> places;
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    const std::uint32_t parent = cell.parents[rank];
    if (parent == kNoParent || children_[parent] != 1 || !(lengths_um_[rank] > 0) || !(lengths_um_[parent] > 0) ||
        isSoma(cell, parent) || isSoma(cell, rank))
      continue;
    const std::uint32_t before = cell.parents[parent];
    if (isSoma(cell, before)) continue;
    const Vector3d on = cell.positions_um[rank] - cell.positions_um[parent],
                   to = cell.positions_um[parent] - cell.positions_um[before];
    const double lengths = static_cast<double>(lengths_um_[rank]) * static_cast<double>(lengths_um_[parent]);
    if (on.dot(to) >= kTurnBack * lengths) continue;
    if (turns++ < Finding::kMostPlaces) places.push_back(findingPlace(cell, parent));
  }
  if (turns == 0) return;
  Finding& finding = add(FindingKind::kBackTracking, false, turns);
  finding.places = std::move(places);
  finding.text = "the neurite turns back at " + counted(turns, "sample");
}

void AnatomyCheck::findRadii(const Cell& cell) {
  const double longest_um = (high_um_ - low_um_).maxCoeff();
  std::uint64_t unknown = 0, large = 0, known = 0;
  float least = std::numeric_limits<float>::infinity(), most = 0;
  Largest largest;
  std::vector<FindingPlace> unknown_places;
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    const float radius_um = cell.radii_um[rank];
    if (!(radius_um > 0)) {
      if (unknown++ < Finding::kMostPlaces) unknown_places.push_back(findingPlace(cell, rank));
      continue;
    }
    if (longest_um > 0 && static_cast<double>(radius_um) > longest_um) {
      ++large;
      largest.offer(static_cast<double>(radius_um), rank);
    }
    if (isSoma(cell, rank)) continue;
    ++known;
    least = std::min(least, radius_um);
    most = std::max(most, radius_um);
  }
  if (unknown > 0) {
    Finding& finding = add(FindingKind::kNoRadius, false, unknown);
    finding.text =
        unknown == cell.samples() ? "no sample has a radius" : counted(unknown, "sample") + " without a radius";
    if (unknown < cell.samples()) finding.places = std::move(unknown_places);
  }
  if (known >= kLeastRadii && least == most)
    add(FindingKind::kConstantRadius, false, 0).text =
        formatted("all neurites have the radius %.4g um", static_cast<double>(least));
  if (large > 0) {
    Finding& finding = add(FindingKind::kLargeRadius, false, large);
    finding.places = largest.places(cell);
    finding.text = counted(large, "radius", "radii") +
                   formatted(" larger than the cell, whose longest side is %.4g um", longest_um);
  }
}

}  // namespace filiform
