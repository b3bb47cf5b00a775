#include "solver/travel/places/cell_walk.h"

#include "solver/travel/routes/route.h"

#include <algorithm>
#include <utility>

namespace filiform {

namespace {

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

CellWalk::CellWalk(CellGraph graph) : paths_(std::move(graph)) {
  const std::uint32_t n = samples();
  std::vector<std::pair<std::uint32_t, std::uint32_t>> down;
  for (std::uint32_t node = 0; node < n; ++node)
    if (parents()[node] != kNoParent && !paths_.isSomaEnd(node)) down.emplace_back(parents()[node], node);
  list(n, down, first_child_, children_);

  // The length of the longest path below each sample, to put the child with the longest neurites first.
  const auto distance_um = [&](std::uint32_t a, std::uint32_t b) {
    return (this->graph().position_W(a) - this->graph().position_W(b)).norm();
  };
  std::vector<double> reach_um(n, 0);
  const std::vector<std::uint32_t> order = parentsFirst(parents());
  for (std::size_t i = order.size(); i-- > 0;) {
    const std::uint32_t node = order[i], parent = parents()[node];
    if (parent != kNoParent) reach_um[parent] = std::max(reach_um[parent], reach_um[node] + distance_um(node, parent));
  }
  for (std::uint32_t node = 0; node < n; ++node)
    std::stable_sort(children_.begin() + first_child_[node], children_.begin() + first_child_[node + 1],
                     [&](std::uint32_t a, std::uint32_t b) {
                       return reach_um[a] + distance_um(a, node) > reach_um[b] + distance_um(b, node);
                     });
}

std::optional<CellWalk::Spot> CellWalk::spotOf(const ProxyPlace& place) const {
  return place.valid() ? paths_.on(place.segment.segment, place.t) : std::nullopt;
}

CellWalk::Spot CellWalk::at(std::uint32_t node) const {
  if (graph().isGraph() || parents()[node] != kNoParent || first_child_[node] == first_child_[node + 1])
    return paths_.at(node);
  const std::uint32_t child = children_[first_child_[node]];
  return {child, 1, child, node};
}

std::optional<std::uint32_t> CellWalk::parent(const Spot& spot) const {
  if (spot.t < 1) {  // at t = 0 the spot's parent need not be the child's parent, if the cell has loops
    if (spot.t > 0 || spot.child == spot.parent)
      return spot.child == spot.parent ? std::nullopt : std::optional(spot.parent);
    return parents()[spot.child] == kNoParent ? std::nullopt : std::optional(parents()[spot.child]);
  }
  return parents()[spot.parent] == kNoParent ? std::nullopt : std::optional(parents()[spot.parent]);
}

std::optional<std::uint32_t> CellWalk::child(const Spot& spot, std::uint32_t turn) const {
  if (spot.t > 0 && spot.t < 1) return paths_.isSomaEnd(spot.child) ? std::nullopt : std::optional(spot.child);
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
  while (node && parents()[*node] != kNoParent && first_child_[*node + 1] - first_child_[*node] == 1)
    node = parents()[*node];
  return node;
}

std::optional<std::uint32_t> CellWalk::otherBranch(const Spot& spot) const {
  std::uint32_t below = spot.t < 1 || spot.child == spot.parent ? spot.child : spot.parent;
  while (parents()[below] != kNoParent) {
    const std::uint32_t fork = parents()[below];
    const std::uint32_t first = first_child_[fork], count = first_child_[fork + 1] - first;
    if (paths_.isSomaEnd(below) && count > 0) return children_[first];
    if (count > 1) {
      std::uint32_t here = 0;
      while (children_[first + here] != below) ++here;
      return children_[first + (here + 1) % count];
    }
    below = fork;
  }
  return std::nullopt;
}

double CellWalk::toRoot_um(const Spot& spot) const {
  Vector3d at_W = position_W(spot);
  double um = 0;
  for (std::uint32_t node = spot.parent;; node = parents()[node]) {
    const Vector3d next_W = graph().position_W(node);
    um += (next_W - at_W).norm();
    if (parents()[node] == kNoParent) return um;
    at_W = next_W;
  }
}

std::uint32_t CellWalk::root(const Spot& spot) const {
  std::uint32_t node = spot.child;
  while (parents()[node] != kNoParent) node = parents()[node];
  return node;
}

}  // namespace filiform
