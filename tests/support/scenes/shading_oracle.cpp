#include "tests/support/scenes/shading_oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filiform::test {

std::vector<std::uint32_t> ShadingOracle::othersByDistance(std::uint32_t node, std::uint32_t segment,
                                                           const Vector3d& h_W) const {
  std::vector<std::pair<double, std::uint32_t>> others;
  for (const std::uint32_t other : graph_.nodes()[node].incident)
    if (other != segment)
      others.push_back({closestPoint(childOf(other), parentOf(other), h_W).squared_distance, other});
  std::sort(others.begin(), others.end());  // numbers are in the order of ids
  std::vector<std::uint32_t> sorted;
  for (const auto& [distance, other] : others) sorted.push_back(other);
  return sorted;
}

Vector3d ShadingOracle::direction(std::uint32_t segment, bool at_parent, const Vector3d& h_W) const {
  const Vector3d own = (parentOf(segment) - childOf(segment)).normalized();
  const WholeGraph::Segment& s = graph_.segments()[segment];
  const std::uint32_t node = at_parent ? s.parent : s.child;
  const Vector3d node_W = graph_.nodes()[node].p_W;
  Vector3d sum = own;
  int taken = 0;
  for (const std::uint32_t other : othersByDistance(node, segment, h_W)) {
    if (childOf(other) == parentOf(other)) continue;
    const Vector3d far_W = graph_.segments()[other].child == node ? parentOf(other) : childOf(other);
    sum += (at_parent ? far_W - node_W : node_W - far_W).normalized();
    if (++taken == 2) break;
  }
  return sum.squaredNorm() > 0.0 ? sum.normalized() : own;
}

bool ShadingOracle::leave(std::uint32_t& segment, double& t, bool by_parent, const Vector3d& h_W) const {
  const WholeGraph::Segment& s = graph_.segments()[segment];
  const std::uint32_t node = by_parent ? s.parent : s.child;
  const std::vector<std::uint32_t> others = othersByDistance(node, segment, h_W);
  if (others.empty()) return false;
  const std::uint32_t next = others.front();
  const bool from_parent = graph_.segments()[next].child != node;
  if (childOf(next) != parentOf(next)) {
    const double f = (h_W - graph_.nodes()[node].p_W).dot(direction(next, from_parent, h_W));
    if (from_parent ? !(f < 0.0) : !(f > 0.0)) return false;
  }
  segment = next;
  t = from_parent ? 1.0 : 0.0;
  return true;
}

std::uint32_t ShadingOracle::advance(const Vector3d& h_W) {
  if (!h_W.allFinite()) return 0;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::uint32_t segment = graph_.segment(place_.segment), walked = 0;
  const std::uint32_t first = segment;
  double t = place_.t;
  while (walked < 64) {
    ++walked;
    const Vector3d a_W = childOf(segment), d_W = parentOf(segment) - a_W;
    if (d_W.isZero(0)) {
      const bool from_parent = t == 1.0;
      if (leave(segment, t, !from_parent, h_W) || leave(segment, t, from_parent, h_W)) continue;
      break;
    }
    const Vector3d at_a = direction(segment, false, h_W), turn = direction(segment, true, h_W) - at_a;
    double a0 = (h_W - a_W).dot(at_a), a1 = (h_W - a_W).dot(turn) - d_W.dot(at_a), a2 = -d_W.dot(turn);
    const double size = std::max({std::abs(a0), std::abs(a1), std::abs(a2)});
    double falling = t, rising = std::nan("");  // zeros
    if (size > 0) {
      a0 /= size, a1 /= size, a2 /= size;
      if (a2 == 0 && a1 < 0) {
        falling = -a0 / a1;
      } else if (a2 == 0 && a1 > 0) {
        rising = -a0 / a1;
        falling = t > rising ? infinity : -infinity;
      } else if (a2 == 0) {
        falling = a0 > 0 ? infinity : -infinity;
      } else if (const double inside = a1 * a1 - 4.0 * a2 * a0; inside < 0) {
        falling = a2 > 0 ? infinity : -infinity;
      } else {
        const double half = -0.5 * (a1 + std::copysign(std::sqrt(inside), a1));
        const double one = half / a2, two = half == 0 ? 0.0 : a0 / half;
        // f = a2 (u - one) (u - two) falls through the larger zero if a2 < 0, else through the smaller.
        falling = a2 < 0 ? std::max(one, two) : std::min(one, two);
        rising = a2 < 0 ? std::min(one, two) : std::max(one, two);
        if (a2 < 0 && !(t > rising)) falling = -infinity;
        if (a2 > 0 && !(t < rising)) falling = infinity;
      }
    }
    t = falling < 0 ? 0.0 : falling > 1 ? 1.0 : std::abs(falling);
    if (falling < 0) {
      if (leave(segment, t, false, h_W)) continue;
    } else if (falling > 1) {
      if (leave(segment, t, true, h_W)) continue;
    }
    break;
  }
  if (segment == first && t == place_.t) return walked;
  place_ = ProxyPlace{};
  place_.segment = graph_.segments()[segment].id;
  place_.t = t;
  place_.at_node = t == 0.0 || t == 1.0;
  place_.p_W = t == 1.0 ? parentOf(segment) : childOf(segment) + t * (parentOf(segment) - childOf(segment));
  const WholeGraph::Segment& s = graph_.segments()[segment];
  if (place_.at_node) place_.node = graph_.nodes()[t == 0.0 ? s.child : s.parent].id;
  return walked;
}

}  // namespace filiform::test
