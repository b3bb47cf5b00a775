#include "tests/support/scenes/shading_oracle.h"

#include <algorithm>
#include <utility>

namespace filiform::test {

Vector3d ShadingOracle::direction(std::uint32_t segment, bool at_parent, const Vector3d& h_W) const {
  const Vector3d own = (parentOf(segment) - childOf(segment)).normalized();
  const WholeGraph::Segment& s = graph_.segments()[segment];
  const std::uint32_t node = at_parent ? s.parent : s.child;
  const Vector3d node_W = graph_.nodes()[node].p_W;
  std::vector<std::pair<double, std::uint32_t>> others;
  for (const std::uint32_t other : graph_.nodes()[node].incident)
    if (other != segment && childOf(other) != parentOf(other))
      others.push_back({closestPoint(childOf(other), parentOf(other), h_W).squared_distance, other});
  std::sort(others.begin(), others.end());  // numbers are in the order of ids
  Vector3d sum = own;
  for (std::size_t i = 0; i < std::min<std::size_t>(2, others.size()); ++i) {
    const std::uint32_t other = others[i].second;
    const Vector3d far_W = graph_.segments()[other].child == node ? parentOf(other) : childOf(other);
    sum += (at_parent ? far_W - node_W : node_W - far_W).normalized();
  }
  return sum.squaredNorm() > 0.0 ? Vector3d(sum.normalized()) : own;
}

std::uint32_t ShadingOracle::advance(const Vector3d& h_W) {
  std::uint32_t tested = 0;
  for (int pass = 0; pass < 16; ++pass) {
    const ProxyPlace from = place();
    const std::uint32_t segment = graph_.segment(from.segment);
    Vector3d goal_W = h_W;
    const Vector3d along = (1 - from.t) * direction(segment, false, h_W) + from.t * direction(segment, true, h_W);
    if (childOf(segment) != parentOf(segment) && along.squaredNorm() > 0) {
      const Vector3d unit = along.normalized();
      goal_W = from.p_W + unit * unit.dot(h_W - from.p_W);
    }
    tested += descent_.advance(goal_W);
    if ((place().p_W - from.p_W).norm() <= 1e-9) break;
  }
  return tested;
}

}  // namespace filiform::test
