#include "index/query/cell_paths.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace filiform {

namespace {

constexpr double kUnreached = std::numeric_limits<double>::infinity();

// The sample at which the place is.
std::optional<std::uint32_t> sampleOf(const CellPlace& place) {
  if (place.t <= 0) return place.child;
  return place.t >= 1 ? std::optional(place.parent) : std::nullopt;
}

}  // namespace

CellPaths::CellPaths(CellGraph graph)
    : graph_(std::move(graph)), is_soma_end_(graph_.samples(), false), first_(graph_.samples() + 1, 0) {
  for (const Soma& soma : graph_.somata.somata)
    for (const std::uint32_t sample : soma.dead_ends) is_soma_end_[sample] = true;
  const auto each_end = [&](const auto& visit) {
    for (std::uint32_t segment = 0; segment < segmentRanks(); ++segment) {
      const auto [child, parent] = ends(segment);
      if (child != parent) {
        visit(child, segment);
        visit(parent, segment);
      } else if (graph_.isGraph()) {
        visit(child, segment);
      }
    }
  };
  each_end([&](std::uint32_t sample, std::uint32_t) { ++first_[sample + 1]; });
  for (std::uint32_t sample = 0; sample < samples(); ++sample) first_[sample + 1] += first_[sample];
  segments_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  each_end([&](std::uint32_t sample, std::uint32_t segment) { segments_[next[sample]++] = segment; });
}

std::uint32_t CellPaths::segmentRanks() const {
  return graph_.isGraph() ? static_cast<std::uint32_t>(graph_.links.size()) : samples();
}

std::array<std::uint32_t, 2> CellPaths::ends(std::uint32_t segment) const {
  if (graph_.isGraph()) return graph_.links[segment];
  const std::uint32_t parent = graph_.parents[segment];
  return {segment, parent == kNoParent ? segment : parent};
}

CellPlace CellPaths::at(std::uint32_t sample) const {
  CellPlace place{sample, 0, sample, sample};
  if (graph_.isGraph() || graph_.parents[sample] == kNoParent) {
    if (first_[sample] == first_[sample + 1]) return place;  // isolated
    place.segment = segments_[graph_.isGraph() ? first_[sample + 1] - 1 : first_[sample]];
  }
  const auto [child, parent] = ends(place.segment);
  return {place.segment, child == sample ? 0.0 : 1.0, child, parent};
}

std::optional<CellPlace> CellPaths::on(std::uint32_t segment, double t) const {
  if (segment >= segmentRanks() || !(t >= 0 && t <= 1)) return std::nullopt;
  const auto [child, parent] = ends(segment);
  if (child == parent && first_[child] != first_[child + 1] && !graph_.isGraph()) return std::nullopt;  // a root
  return CellPlace{segment, t, child, parent};
}

Vector3d CellPaths::position_W(const CellPlace& place) const {
  const Vector3d child = graph_.position_W(place.child);
  return child + place.t * (graph_.position_W(place.parent) - child);
}

std::vector<std::uint32_t> CellPaths::segmentsAt(std::uint32_t sample) const {
  return {segments_.begin() + first_[sample], segments_.begin() + first_[sample + 1]};
}

// Dijkstra's algorithm. With `until`, it ends when both ends of that place's segment have their final length.
CellPaths::Reached CellPaths::reach(const CellPlace& from, const CellPlace* until) const {
  Reached reached{std::vector<double>(samples(), kUnreached), std::vector<std::uint32_t>(samples(), kNoParent)};
  using Item = std::pair<double, std::uint32_t>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  const auto offer = [&](std::uint32_t sample, double length_um, std::uint32_t before) {
    if (!(length_um < reached.length_um[sample])) return;
    reached.length_um[sample] = length_um;
    reached.before[sample] = before;
    queue.emplace(length_um, sample);
  };
  const double length_um = distance_um(from.child, from.parent);
  offer(from.child, from.t * length_um, kNoParent);
  offer(from.parent, (1 - from.t) * length_um, kNoParent);
  bool child_is_final = until == nullptr, parent_is_final = until == nullptr;
  while (!queue.empty()) {
    const auto [at_um, sample] = queue.top();
    queue.pop();
    if (at_um > reached.length_um[sample]) continue;
    if (until != nullptr) {
      child_is_final |= sample == until->child;
      parent_is_final |= sample == until->parent;
      if (child_is_final && parent_is_final) break;
    }
    for (std::uint32_t i = first_[sample]; i < first_[sample + 1]; ++i) {
      const auto [child, parent] = ends(segments_[i]);
      const std::uint32_t next = child == sample ? parent : child;
      offer(next, at_um + distance_um(sample, next), sample);
    }
  }
  return reached;
}

std::optional<CellPaths::Arrival> CellPaths::arrive(const Reached& reached, const CellPlace& from,
                                                    const CellPlace& to) const {
  const double length_um = distance_um(to.child, to.parent);
  const double by_child = reached.length_um[to.child] + to.t * length_um;
  const double by_parent = reached.length_um[to.parent] + (1 - to.t) * length_um;
  const bool child_is_nearer = by_child < by_parent || (by_child == by_parent && to.t < 1);
  Arrival arrival = child_is_nearer ? Arrival{by_child, to.child} : Arrival{by_parent, to.parent};
  const double within_um = std::abs(from.t - to.t) * length_um;
  if (from.segment == to.segment && within_um <= arrival.length_um) arrival = {within_um, kNoParent};
  return arrival.length_um < kUnreached ? std::optional(arrival) : std::nullopt;
}

std::optional<double> CellPaths::length_um(const CellPlace& from, const CellPlace& to) const {
  const std::optional<Arrival> arrival = arrive(reach(from, &to), from, to);
  return arrival ? std::optional(arrival->length_um) : std::nullopt;
}

CellPath::Point CellPaths::pointAt(const CellPlace& place, double along_um) const {
  return {position_W(place), along_um, sampleOf(place)};
}

std::optional<CellPath> CellPaths::path(const CellPlace& from, const CellPlace& to) const {
  const Reached reached = reach(from, &to);
  const std::optional<Arrival> arrival = arrive(reached, from, to);
  if (!arrival) return std::nullopt;
  CellPath path;
  for (std::uint32_t sample = arrival->by; sample != kNoParent; sample = reached.before[sample])
    path.points.push_back({graph_.position_W(sample), reached.length_um[sample], sample});
  if (path.points.empty() || path.points.back().sample != sampleOf(from)) path.points.push_back(pointAt(from, 0));
  std::reverse(path.points.begin(), path.points.end());
  const std::optional<std::uint32_t> last = sampleOf(to);
  const bool is_there =
      last ? path.points.back().sample == last : arrival->by == kNoParent && from.t == to.t;  // no way to go
  if (!is_there) path.points.push_back(pointAt(to, arrival->length_um));
  return path;
}

std::vector<double> CellPaths::lengths_um(const CellPlace& from) const { return reach(from).length_um; }

bool CellPaths::isTip(std::uint32_t sample) const {
  if (is_soma_end_[sample]) return false;
  std::uint32_t branches = 0;
  for (std::uint32_t i = first_[sample]; i < first_[sample + 1]; ++i) {
    const auto [child, parent] = ends(segments_[i]);
    branches += child == parent || is_soma_end_[child == sample ? parent : child] ? 0 : 1;
  }
  return branches == 1;
}

std::vector<std::uint32_t> CellPaths::tips(const CellPlace& from, std::size_t most) const {
  const std::vector<double> length_um = lengths_um(from);
  std::vector<std::uint32_t> found;
  for (std::uint32_t sample = 0; sample < samples(); ++sample)
    if (isTip(sample) && length_um[sample] > 0 && length_um[sample] < kUnreached) found.push_back(sample);
  const std::size_t kept = std::min(most, found.size());
  std::partial_sort(
      found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(),
      [&](std::uint32_t a, std::uint32_t b) { return std::pair(length_um[a], a) < std::pair(length_um[b], b); });
  found.resize(kept);
  return found;
}

std::optional<std::uint32_t> CellPaths::farthestTip(const CellPlace& from) const {
  const std::vector<double> length_um = lengths_um(from);
  std::optional<std::uint32_t> best;
  for (std::uint32_t sample = 0; sample < samples(); ++sample)
    if (isTip(sample) && length_um[sample] > 0 && length_um[sample] < kUnreached &&
        (!best || length_um[sample] > length_um[*best]))
      best = sample;
  return best;
}

}  // namespace filiform
