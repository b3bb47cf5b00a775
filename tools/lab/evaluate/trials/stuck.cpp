#include "tools/lab/evaluate/trials/stuck.h"

#include "index/geometry/closest_point.h"

#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

// Differences within rounding do not count as nearer.
constexpr double kNearer = 1 - 1e-9;

}  // namespace

bool inherentlyStuck(TrialCell& cell, const ProxyPlace& place, const Vector3d& h_W) {
  const double limit2 = (place.p_W - h_W).squaredNorm() * kNearer;
  return cell.tree(cell.root(place.segment.segment)).nearest(h_W, limit2).segment == SegmentTree::kNone;
}

double leastClimb_um(TrialCell& cell, const ProxyPlace& place, const Vector3d& h_W) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  if (inherentlyStuck(cell, place, h_W)) return kInfinite;
  const CellGraph& graph = cell.graph();
  std::vector<std::vector<std::uint32_t>> children(graph.samples());
  for (std::uint32_t rank = 0; rank < graph.samples(); ++rank)
    if (graph.parents[rank] != kNoParent) children[graph.parents[rank]].push_back(rank);
  const double limit2 = (place.p_W - h_W).squaredNorm() * kNearer;

  using Entry = std::pair<double, std::uint32_t>;  // cost, node
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> heap;
  std::unordered_map<std::uint32_t, double> cost;
  const auto offer = [&](std::uint32_t node, double um) {
    const auto [at, fresh] = cost.emplace(node, um);
    if (!fresh && at->second <= um) return;
    at->second = um;
    heap.emplace(um, node);
  };
  double best = kInfinite;
  // From a point at t of a segment to its end `to`, the distance rises only beyond the segment's closest point.
  const auto cross = [&](std::uint32_t child, double t, double um) {
    const std::uint32_t parent = graph.parents[child];
    const Vector3d child_W = graph.position_W(child), parent_W = graph.position_W(parent);
    const double length_um = (parent_W - child_W).norm();
    const ClosestPoint q = closestPoint(child_W, parent_W, h_W);
    if (q.squared_distance < limit2) best = std::min(best, um);  // the distance only falls on the way to q
    offer(child, um + length_um * std::min(q.t, t));
    offer(parent, um + length_um * (1 - std::max(q.t, t)));
  };
  cross(place.segment.segment, place.t, 0);
  while (!heap.empty()) {
    const auto [um, node] = heap.top();
    heap.pop();
    if (um > cost[node]) continue;
    if (um >= best) break;
    if (graph.parents[node] != kNoParent) cross(node, 0, um);
    for (const std::uint32_t child : children[node]) cross(child, 1, um);
  }
  return best;
}

}  // namespace filiform::tools
