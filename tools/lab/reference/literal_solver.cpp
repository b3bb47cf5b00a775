#include "tools/lab/reference/literal_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filiform::tools {

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

ProxyPlace LiteralSolver::place() const {
  const WholeGraph::Segment& s = graph_.segments()[segment_];
  ProxyPlace place;
  place.segment = s.id;
  place.t = t_;
  place.p_W = p_W_;
  place.at_node = t_ == 0.0 || t_ == 1.0;
  if (place.at_node) place.node = graph_.nodes()[t_ == 0.0 ? s.child : s.parent].id;
  return place;
}

void LiteralSolver::setPlace(const ProxyPlace& place) {
  segment_ = graph_.segment(place.segment);
  t_ = place.t;
  p_W_ = place.p_W;
}

std::uint32_t LiteralSolver::advance(const Vector3d& h_W) {
  if (!h_W.allFinite()) return 0;
  seen_segments_.clear();
  seen_nodes_.clear();
  h_W_ = h_W;
  best2_ = (p_W_ - h_W).squaredNorm();
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const WholeGraph::Segment& s = graph_.segments()[segment_];
  const bool at_node = t_ == 0.0 || t_ == 1.0;
  if (method_ == SolverMethod::force_listing) {
    if (at_node)
      listedNode(t_ == 0.0 ? s.child : s.parent, best2_);
    else
      listedSegment(segment_, -1, best2_);
  } else if (at_node) {
    visitNode(t_ == 0.0 ? s.child : s.parent, kNone);
  } else {
    visitSegment(segment_, -1, kNone);
  }
  return static_cast<std::uint32_t>(seen_segments_.size());
}

void LiteralSolver::visitSegment(std::uint32_t number, std::int64_t entered, double d_sub2) {
  if (!seen_segments_.insert(number).second) return;
  const WholeGraph::Segment& s = graph_.segments()[number];
  const Vector3d child_W = graph_.nodes()[s.child].p_W, parent_W = graph_.nodes()[s.parent].p_W;
  const ClosestPoint q = closestPoint(child_W, parent_W, h_W_);
  take(number, q);
  if (child_W == parent_W) {  // q is the end that was not entered; the sub-goal stays
    if (entered != s.child) visitNode(s.child, d_sub2);
    if (entered != s.parent) visitNode(s.parent, d_sub2);
    return;
  }
  const bool at_end = q.t == 0.0 || q.t == 1.0;
  if (method_ == SolverMethod::basic) {
    if (at_end) visitNode(q.t == 0.0 ? s.child : s.parent, d_sub2);
    return;
  }
  if (at_end) {
    const std::uint32_t end = q.t == 0.0 ? s.child : s.parent;
    if (seen_nodes_.count(end) == 0 && q.squared_distance < d_sub2) visitNode(end, q.squared_distance);
    return;
  }
  if (!(q.squared_distance < d_sub2)) return;
  const double r =
      std::min(parameters_.r_max_um, parameters_.gain * std::sqrt(q.squared_distance) + parameters_.r_min_um);
  for (const std::uint32_t end : {s.child, s.parent}) {
    if (seen_nodes_.count(end) != 0) continue;
    if ((graph_.nodes()[end].p_W - q.p_W).norm() < r) visitNode(end, q.squared_distance);
  }
}

void LiteralSolver::visitNode(std::uint32_t node, double d_sub2) {
  if (!seen_nodes_.insert(node).second) return;
  for (const std::uint32_t segment : graph_.nodes()[node].incident) visitSegment(segment, node, d_sub2);
}

double LiteralSolver::listedSegment(std::uint32_t number, std::int64_t entered, double dist2) {
  if (!seen_segments_.insert(number).second) return std::numeric_limits<double>::max();
  const WholeGraph::Segment& s = graph_.segments()[number];
  const Vector3d child_W = graph_.nodes()[s.child].p_W, parent_W = graph_.nodes()[s.parent].p_W;
  const ClosestPoint q = closestPoint(child_W, parent_W, h_W_);
  const bool transparent = child_W == parent_W;
  if (q.squared_distance > dist2 && !transparent) return std::numeric_limits<double>::max();
  take(number, q);
  dist2 = std::min(dist2, q.squared_distance);
  const double r =
      std::min(parameters_.r_max_um, parameters_.gain * std::sqrt(q.squared_distance) + parameters_.r_min_um);
  for (const std::uint32_t end : {s.child, s.parent}) {
    if (transparent ? entered == end : (graph_.nodes()[end].p_W - q.p_W).norm() > r) continue;
    dist2 = std::min(dist2, listedNode(end, dist2));
  }
  return dist2;
}

double LiteralSolver::listedNode(std::uint32_t node, double dist2) {
  if (!seen_nodes_.insert(node).second) return std::numeric_limits<double>::max();
  for (const std::uint32_t segment : graph_.nodes()[node].incident)
    dist2 = std::min(dist2, listedSegment(segment, node, dist2));
  return dist2;
}

void LiteralSolver::take(std::uint32_t number, const ClosestPoint& q) {
  if (!(q.squared_distance < best2_)) return;
  best2_ = q.squared_distance;
  segment_ = number;
  t_ = q.t;
  p_W_ = q.p_W;
}

}  // namespace filiform::tools
