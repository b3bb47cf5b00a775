#include "tests/support/paper_oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filiform::test {

WholeGraph::WholeGraph(std::span<const StoredSegment> segments, const Grid& grid) {
  std::vector<StoredSegment> sorted(segments.begin(), segments.end());
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  const auto nodeNumber = [&](NodeId id, const GridPoint& p) {
    const auto [at, is_new] = node_numbers_.try_emplace(id, static_cast<std::uint32_t>(nodes_.size()));
    if (is_new) nodes_.push_back({id, grid.toWorld(p), {}});
    return at->second;
  };
  for (const StoredSegment& s : sorted) {
    const auto number = static_cast<std::uint32_t>(segments_.size());
    const std::uint32_t child = nodeNumber({s.id.cell, s.child_sample}, s.child);
    const std::uint32_t parent = nodeNumber({s.id.cell, s.parent_sample}, s.parent);
    segments_.push_back({s.id, child, parent});
    segment_numbers_[s.id] = number;
    nodes_[child].incident.push_back(number);
    if (child != parent) nodes_[parent].incident.push_back(number);
  }
}

std::uint32_t PaperOracle::advance(const Vector3d& h_W) {
  if (!h_W.allFinite()) return 0;
  seen_segments_.clear();
  seen_nodes_.clear();
  h_W_ = h_W;
  best2_ = (place_.p_W - h_W).squaredNorm();
  constexpr double none = std::numeric_limits<double>::infinity();
  const ProxyPlace start = place_;
  if (start.at_node) {
    visitNode(graph_.node(start.node), none);
  } else {
    visitSegment(graph_.segment(start.segment), -1, none);
  }
  return static_cast<std::uint32_t>(seen_segments_.size());
}

void PaperOracle::visitSegment(std::uint32_t number, std::int64_t entered, double d_sub2) {
  if (!seen_segments_.insert(number).second) return;
  const WholeGraph::Segment& s = graph_.segments()[number];
  const Vector3d child_W = graph_.nodes()[s.child].p_W, parent_W = graph_.nodes()[s.parent].p_W;
  const ClosestPoint q = closestPoint(child_W, parent_W, h_W_);
  if (q.squared_distance < best2_) {
    best2_ = q.squared_distance;
    place_ = ProxyPlace{};
    place_.segment = s.id;
    place_.t = q.t;
    place_.p_W = q.p_W;
    place_.at_node = q.t == 0.0 || q.t == 1.0;
    if (place_.at_node) place_.node = graph_.nodes()[q.t == 0.0 ? s.child : s.parent].id;
  }
  if (child_W == parent_W) {  // q is the end that was not entered from; the sub-goal stays
    if (entered != s.child) visitNode(s.child, d_sub2);
    if (entered != s.parent) visitNode(s.parent, d_sub2);
    return;
  }
  const bool at_end = q.t == 0.0 || q.t == 1.0;
  if (!force_) {
    if (at_end) visitNode(q.t == 0.0 ? s.child : s.parent, d_sub2);
    return;
  }
  if (at_end) {
    const std::uint32_t end = q.t == 0.0 ? s.child : s.parent;
    if (seen_nodes_.count(end) == 0 && q.squared_distance <= d_sub2) visitNode(end, q.squared_distance);
    return;
  }
  if (q.squared_distance > d_sub2) return;
  const double r =
      std::min(parameters_.r_max_um, parameters_.gain * std::sqrt(q.squared_distance) + parameters_.r_min_um);
  for (const std::uint32_t end : {s.child, s.parent}) {
    if (seen_nodes_.count(end) != 0) continue;
    if ((graph_.nodes()[end].p_W - q.p_W).norm() < r) visitNode(end, q.squared_distance);
  }
}

void PaperOracle::visitNode(std::uint32_t node, double d_sub2) {
  if (!seen_nodes_.insert(node).second) return;
  for (const std::uint32_t segment : graph_.nodes()[node].incident) visitSegment(segment, node, d_sub2);
}

}  // namespace filiform::test
