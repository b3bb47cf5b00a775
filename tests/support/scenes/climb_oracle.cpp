#include "tests/support/scenes/climb_oracle.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <set>
#include <tuple>

namespace filiform::test {

void ClimbOracle::setPlace(const ProxyPlace& place) {
  place_ = place;
  patience_mm_ = 0;
  last_W_ = place.p_W;
}

std::uint32_t ClimbOracle::advance(const ProbeState& probe) {
  if (!probe.h_W.allFinite()) return 0;
  const auto device_mm = [&](double length_um) { return 1e3 * (length_um / probe.scale_um_m); };
  const double pull_mm = device_mm(std::sqrt((place_.p_W - probe.h_W).squaredNorm()));
  const double growth = parameters_.growth_1_mm, moved_mm = device_mm((place_.p_W - last_W_).norm());
  last_W_ = place_.p_W;
  double m = std::max(0.0, patience_mm_ - parameters_.motion_cost * (1 + growth * patience_mm_) * moved_mm);
  if (pull_mm > parameters_.pull_mm)
    m += parameters_.patience_1_s * (1 + growth * m) *
         std::min(pull_mm - parameters_.pull_mm, parameters_.most_pull_mm) * probe.dt_s;
  else
    m *= std::max(0.0, 1.0 - probe.dt_s / 0.2);
  patience_mm_ = std::min(m, parameters_.most_mm);

  // The search, with the budget in um, which depends on the active segment.
  const Vector3d h_W = probe.h_W;
  const std::uint32_t active = graph_.segment(place_.segment);
  const WholeGraph::Segment& s = graph_.segments()[active];
  const Vector3d child_W = graph_.nodes()[s.child].p_W, parent_W = graph_.nodes()[s.parent].p_W;
  const ClosestPoint q = closestPoint(child_W, parent_W, h_W);
  const double t0 = place_.t, before2 = (place_.p_W - h_W).squaredNorm();
  const auto take = [&](std::uint32_t segment, const ClosestPoint& w) {
    const WholeGraph::Segment& taken = graph_.segments()[segment];
    place_ = ProxyPlace{};
    place_.segment = taken.id;
    place_.t = w.t;
    place_.p_W = w.p_W;
    place_.at_node = w.t == 0.0 || w.t == 1.0;
    if (place_.at_node) place_.node = graph_.nodes()[w.t == 0.0 ? taken.child : taken.parent].id;
  };
  double best2 = before2;
  if (q.squared_distance < best2) {
    best2 = q.squared_distance;
    take(active, q);
  }
  climbed_um_ = 0;
  const double budget_mm = std::min(
      parameters_.most_mm, parameters_.rest_mm + parameters_.gain * device_mm(std::sqrt(best2)) + patience_mm_);
  budget_um_ = 1e-3 * probe.leap * budget_mm * probe.scale_um_m;

  using Offer = std::tuple<double, NodeId, std::uint32_t>;
  std::priority_queue<Offer, std::vector<Offer>, std::greater<>> queue;
  std::map<std::uint32_t, double> costs;
  std::set<std::uint32_t> done, tested{active};
  const auto offer = [&](std::uint32_t node, double cost) {
    if (!(cost <= budget_um_)) return;
    const auto known = costs.find(node);
    if (known != costs.end() && known->second <= cost) return;
    costs[node] = cost;
    queue.push({cost, graph_.nodes()[node].id, node});
  };
  const double length = (parent_W - child_W).norm();
  offer(s.child, length * std::min(q.t, t0));
  offer(s.parent, length * (1.0 - std::max(q.t, t0)));
  while (!queue.empty()) {
    const auto [cost, id, node] = queue.top();
    queue.pop();
    if (!done.insert(node).second) continue;
    for (const std::uint32_t number : graph_.nodes()[node].incident) {
      if (!tested.insert(number).second) continue;
      const WholeGraph::Segment& next = graph_.segments()[number];
      const ClosestPoint w = closestPoint(graph_.nodes()[next.child].p_W, graph_.nodes()[next.parent].p_W, h_W);
      const double distance = std::sqrt(best2), least = distance - std::max(1e-9, 1e-12 * distance);
      if (least > 0 && w.squared_distance < least * least) {
        best2 = w.squared_distance;
        take(number, w);
        climbed_um_ = cost;
      }
      const std::uint32_t far = next.child == node ? next.parent : next.child;
      offer(far, cost + (graph_.nodes()[far].p_W - w.p_W).norm());
    }
  }
  return static_cast<std::uint32_t>(tested.size());
}

}  // namespace filiform::test
