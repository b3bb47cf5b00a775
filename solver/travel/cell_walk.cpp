#include "solver/travel/cell_walk.h"

#include "solver/travel/route.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace filiform {

namespace {

constexpr double kUnreached = std::numeric_limits<double>::infinity();

// Groups the items of {key, item} pairs by key: the items of key k are items[first[k] .. first[k + 1]).
void list(std::uint32_t keys, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs,
          std::vector<std::uint32_t>& first, std::vector<std::uint32_t>& items) {
  first.assign(keys + 1, 0);
  for (const auto& [key, item] : pairs) ++first[key + 1];
  for (std::uint32_t key = 0; key < keys; ++key) first[key + 1] += first[key];
  items.resize(pairs.size());
  std::vector<std::uint32_t> at(first.begin(), first.end() - 1);
  for (const auto& [key, item] : pairs) items[at[key]++] = item;
}

}  // namespace

CellWalk::CellWalk(CellGraph graph)
    : graph_(std::move(graph)), is_soma_end_(graph_.samples(), false), parents_(graph_.parents) {
  const std::uint32_t n = samples();
  segment_at_.resize(n);
  std::vector<std::uint32_t> soma_end_below(n, kNoParent);
  for (const Soma& soma : graph_.somata.somata)
    for (const std::uint32_t node : soma.dead_ends) {
      is_soma_end_[node] = true;
      soma_end_below[parents_[node]] = node;
    }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> down, both;
  for (std::uint32_t node = 0; node < n; ++node) {
    if (parents_[node] == kNoParent) continue;
    if (!is_soma_end_[node]) down.emplace_back(parents_[node], node);
    if (graph_.isGraph()) continue;
    both.emplace_back(parents_[node], node);
    both.emplace_back(node, parents_[node]);
  }
  for (std::uint32_t rank = 0; rank < graph_.links.size(); ++rank) {
    const auto [child, parent] = graph_.links[rank];
    segment_at_[child] = segment_at_[parent] = rank;
    if (child == parent) continue;
    both.emplace_back(parent, child);
    both.emplace_back(child, parent);
  }
  list(n, down, first_child_, children_);
  list(n, both, first_neighbour_, neighbours_);

  // The length of the longest path below each sample, to put the child with the longest neurites first.
  std::vector<double> reach_um(n, 0);
  const std::vector<std::uint32_t> order = parentsFirst(parents_);
  for (std::size_t i = order.size(); i-- > 0;) {
    const std::uint32_t node = order[i];
    if (parents_[node] != kNoParent)
      reach_um[parents_[node]] = std::max(reach_um[parents_[node]], reach_um[node] + distance(node, parents_[node]));
  }
  for (std::uint32_t node = 0; node < n; ++node) {
    const auto begin = children_.begin() + first_child_[node], end = children_.begin() + first_child_[node + 1];
    std::stable_sort(begin, end, [&](std::uint32_t a, std::uint32_t b) {
      return reach_um[a] + distance(a, node) > reach_um[b] + distance(b, node);
    });
    if (graph_.isGraph()) continue;
    segment_at_[node] = node;
    if (parents_[node] != kNoParent) continue;
    if (begin != end)
      segment_at_[node] = *begin;
    else if (soma_end_below[node] != kNoParent)
      segment_at_[node] = soma_end_below[node];
  }
}

std::optional<CellWalk::Spot> CellWalk::spotOf(const ProxyPlace& place) const {
  const std::uint32_t rank = place.segment.segment;
  if (!place.valid() || rank >= (graph_.isGraph() ? graph_.links.size() : graph_.samples())) return std::nullopt;
  Spot spot{rank, place.t, rank, rank};
  if (graph_.isGraph()) {
    spot.child = graph_.links[rank][0];
    spot.parent = graph_.links[rank][1];
  } else if (parents_[rank] != kNoParent) {
    spot.parent = parents_[rank];
  }
  return spot;
}

CellWalk::Spot CellWalk::at(std::uint32_t node) const {
  Spot spot{segment_at_[node], 0, segment_at_[node], segment_at_[node]};
  if (graph_.isGraph()) {
    spot.child = graph_.links[spot.segment][0];
    spot.parent = graph_.links[spot.segment][1];
  } else if (parents_[spot.segment] != kNoParent) {
    spot.parent = parents_[spot.segment];
  }
  spot.t = spot.child == node ? 0 : 1;
  return spot;
}

Vector3d CellWalk::position_W(const Spot& spot) const {
  const Vector3d child = graph_.position_W(spot.child);
  return child + spot.t * (graph_.position_W(spot.parent) - child);
}

std::optional<std::uint32_t> CellWalk::parent(const Spot& spot) const {
  if (spot.t < 1) {  // at t = 0 the spot's parent need not be the child's parent, if the cell has loops
    if (spot.t > 0 || spot.child == spot.parent)
      return spot.child == spot.parent ? std::nullopt : std::optional(spot.parent);
    return parents_[spot.child] == kNoParent ? std::nullopt : std::optional(parents_[spot.child]);
  }
  return parents_[spot.parent] == kNoParent ? std::nullopt : std::optional(parents_[spot.parent]);
}

std::optional<std::uint32_t> CellWalk::child(const Spot& spot, std::uint32_t turn) const {
  if (spot.t > 0 && spot.t < 1) return is_soma_end_[spot.child] ? std::nullopt : std::optional(spot.child);
  const std::uint32_t node = spot.t > 0 ? spot.parent : spot.child;
  const std::uint32_t count = first_child_[node + 1] - first_child_[node];
  if (count == 0) return std::nullopt;
  return children_[first_child_[node] + turn % count];
}

std::optional<std::uint32_t> CellWalk::nextBranch(const Spot& spot, std::uint32_t turn) const {
  std::optional<std::uint32_t> node = child(spot, turn);
  while (node && first_child_[*node + 1] - first_child_[*node] == 1) node = children_[first_child_[*node]];
  return node;
}

std::optional<std::uint32_t> CellWalk::previousBranch(const Spot& spot) const {
  std::optional<std::uint32_t> node = parent(spot);
  while (node && parents_[*node] != kNoParent && first_child_[*node + 1] - first_child_[*node] == 1)
    node = parents_[*node];
  return node;
}

std::optional<std::uint32_t> CellWalk::otherBranch(const Spot& spot) const {
  std::uint32_t below = spot.t < 1 || spot.child == spot.parent ? spot.child : spot.parent;
  while (parents_[below] != kNoParent) {
    const std::uint32_t fork = parents_[below];
    const std::uint32_t first = first_child_[fork], count = first_child_[fork + 1] - first;
    if (is_soma_end_[below] && count > 0) return children_[first];
    if (count > 1) {
      std::uint32_t here = 0;
      while (children_[first + here] != below) ++here;
      return children_[first + (here + 1) % count];
    }
    below = fork;
  }
  return std::nullopt;
}

std::uint32_t CellWalk::root(const Spot& spot) const {
  std::uint32_t node = spot.child;
  while (parents_[node] != kNoParent) node = parents_[node];
  return node;
}

bool CellWalk::isTip(std::uint32_t node) const {
  if (is_soma_end_[node]) return false;
  std::uint32_t branches = 0;
  for (std::uint32_t i = first_neighbour_[node]; i < first_neighbour_[node + 1]; ++i)
    branches += is_soma_end_[neighbours_[i]] ? 0 : 1;
  return branches == 1;
}

CellWalk::Reached CellWalk::reach(const Spot& from) const {
  Reached reached{std::vector<double>(samples(), kUnreached), std::vector<std::uint32_t>(samples(), kNoParent)};
  using Item = std::pair<double, std::uint32_t>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  const auto start = [&](std::uint32_t node, double length_um) {
    if (!(length_um < reached.length_um[node])) return;
    reached.length_um[node] = length_um;
    queue.emplace(length_um, node);
  };
  const double length_um = distance(from.child, from.parent);
  start(from.child, from.t * length_um);
  start(from.parent, (1 - from.t) * length_um);
  while (!queue.empty()) {
    const auto [at_um, node] = queue.top();
    queue.pop();
    if (at_um > reached.length_um[node]) continue;
    for (std::uint32_t i = first_neighbour_[node]; i < first_neighbour_[node + 1]; ++i) {
      const std::uint32_t next = neighbours_[i];
      const double next_um = at_um + distance(node, next);
      if (!(next_um < reached.length_um[next])) continue;
      reached.length_um[next] = next_um;
      reached.before[next] = node;
      queue.emplace(next_um, next);
    }
  }
  return reached;
}

std::vector<std::uint32_t> CellWalk::tips(const Spot& spot, std::size_t most) const {
  const Reached reached = reach(spot);
  std::vector<std::uint32_t> found;
  for (std::uint32_t node = 0; node < samples(); ++node)
    if (isTip(node) && reached.length_um[node] > 0 && reached.length_um[node] < kUnreached) found.push_back(node);
  const std::size_t kept = std::min(most, found.size());
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(),
                    [&](std::uint32_t a, std::uint32_t b) {
                      return std::pair(reached.length_um[a], a) < std::pair(reached.length_um[b], b);
                    });
  found.resize(kept);
  return found;
}

std::optional<std::uint32_t> CellWalk::farthestTip(const Spot& spot) const {
  const Reached reached = reach(spot);
  std::optional<std::uint32_t> best;
  for (std::uint32_t node = 0; node < samples(); ++node)
    if (isTip(node) && reached.length_um[node] > 0 && reached.length_um[node] < kUnreached &&
        (!best || reached.length_um[node] > reached.length_um[*best]))
      best = node;
  return best;
}

std::optional<double> CellWalk::lengthTo(const Reached& reached, const Spot& from, const Spot& to,
                                         std::uint32_t* by) const {
  const double length_um = distance(to.child, to.parent);
  const double by_child = reached.length_um[to.child] + to.t * length_um;
  const double by_parent = reached.length_um[to.parent] + (1 - to.t) * length_um;
  double best = std::min(by_child, by_parent);
  std::uint32_t last = by_child <= by_parent ? to.child : to.parent;
  if (from.segment == to.segment && std::abs(from.t - to.t) * length_um <= best) {
    best = std::abs(from.t - to.t) * length_um;
    last = kNoParent;
  }
  if (by != nullptr) *by = last;
  return best < kUnreached ? std::optional(best) : std::nullopt;
}

std::optional<double> CellWalk::pathLength_um(const Spot& a, const Spot& b) const { return lengthTo(reach(a), a, b); }

std::vector<std::uint32_t> CellWalk::path(const Spot& a, const Spot& b) const {
  const Reached reached = reach(a);
  std::uint32_t node = kNoParent;
  std::vector<std::uint32_t> nodes;
  if (!lengthTo(reached, a, b, &node)) return nodes;
  for (; node != kNoParent; node = reached.before[node]) nodes.push_back(node);
  std::reverse(nodes.begin(), nodes.end());
  return nodes;
}

}  // namespace filiform
