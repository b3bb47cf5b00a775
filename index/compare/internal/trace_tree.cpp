#include "index/compare/internal/trace_tree.h"

#include "index/geometry/closest_point.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {
namespace {

constexpr std::uint32_t kMostInLeaf = 4;
constexpr std::size_t kMostDepth = 64;  // each level halves the segments

double squaredDistanceTo(const Vector3d& p_W, const TraceTree::Segment& s) {
  return closestPoint(s.ends_W[0], s.ends_W[1], p_W).squared_distance;
}

}  // namespace

TraceTree::TraceTree(const CellGraph& cell) {
  std::vector<bool> linked(cell.samples());
  for (const auto& [parent, child] : parentLinks(cell)) {
    segments_.push_back({{cell.position_W(child), cell.position_W(parent)}});
    linked[parent] = linked[child] = true;
  }
  for (std::uint32_t i = 0; i < cell.samples(); ++i)
    if (!linked[i]) segments_.push_back({{cell.position_W(i), cell.position_W(i)}});
  build(0, static_cast<std::uint32_t>(segments_.size()));
}

std::uint32_t TraceTree::build(std::uint32_t begin, std::uint32_t end) {
  const auto at = static_cast<std::uint32_t>(nodes_.size());
  WorldBox box{segments_[begin].ends_W[0], segments_[begin].ends_W[0]};
  for (std::uint32_t i = begin; i < end; ++i)
    for (const Vector3d& p : segments_[i].ends_W) {
      box.lo_W = box.lo_W.cwiseMin(p);
      box.hi_W = box.hi_W.cwiseMax(p);
    }
  nodes_.push_back({box, begin, end, 0});
  if (end - begin <= kMostInLeaf) return at;
  Eigen::Index axis = 0;
  (box.hi_W - box.lo_W).maxCoeff(&axis);
  const auto first = segments_.begin() + begin;
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(first, segments_.begin() + middle, segments_.begin() + end, [&](const Segment& a, const Segment& b) {
    return a.ends_W[0][axis] + a.ends_W[1][axis] < b.ends_W[0][axis] + b.ends_W[1][axis];
  });
  build(begin, middle);
  const std::uint32_t second = build(middle, end);
  nodes_[at].second = second;
  return at;
}

double TraceTree::distance_um(const Vector3d& p_W, std::uint32_t& near) const {
  double best2 = squaredDistanceTo(p_W, segments_[near]);
  struct Open {
    std::uint32_t node;
    double below2;
  };
  std::array<Open, kMostDepth> open;
  std::size_t count = 0;
  open[count++] = {0, nodes_[0].box.squaredDistanceBelow(p_W)};
  while (count > 0) {
    const Open next = open[--count];
    if (next.below2 >= best2) continue;
    const Node& node = nodes_[next.node];
    if (node.second == 0) {
      for (std::uint32_t i = node.begin; i < node.end; ++i)
        if (const double d2 = squaredDistanceTo(p_W, segments_[i]); d2 < best2) {
          best2 = d2;
          near = i;
        }
      continue;
    }
    Open first{next.node + 1, nodes_[next.node + 1].box.squaredDistanceBelow(p_W)};
    Open second{node.second, nodes_[node.second].box.squaredDistanceBelow(p_W)};
    if (first.below2 < second.below2) std::swap(first, second);
    open[count++] = first;  // the nearer one is taken first
    open[count++] = second;
  }
  return std::sqrt(best2);
}

void TraceTree::forEachIn(const WorldBox& box, const std::function<void(const Segment& segment)>& use) const {
  std::vector<std::uint32_t> open{0};
  while (!open.empty()) {
    const std::uint32_t at = open.back();
    const Node& node = nodes_[at];
    open.pop_back();
    if ((node.box.lo_W.array() > box.hi_W.array()).any() || (node.box.hi_W.array() < box.lo_W.array()).any()) continue;
    if (node.second == 0) {
      for (std::uint32_t i = node.begin; i < node.end; ++i) use(segments_[i]);
    } else {
      open.push_back(at + 1);
      open.push_back(node.second);
    }
  }
}

}  // namespace filiform::internal
