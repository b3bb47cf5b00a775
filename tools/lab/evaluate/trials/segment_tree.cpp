#include "tools/lab/evaluate/trials/segment_tree.h"

#include <algorithm>
#include <array>
#include <limits>

namespace filiform::tools {

namespace {

constexpr std::uint32_t kLeaf = 4;

double squaredDistance(const Vector3d& lo, const Vector3d& hi, const Vector3d& h) {
  return (lo - h).cwiseMax(h - hi).cwiseMax(0.0).squaredNorm();
}

}  // namespace

SegmentTree::SegmentTree(const CellGraph& cell, const std::vector<std::uint32_t>& children) {
  segments_.reserve(children.size());
  for (const std::uint32_t child : children)
    segments_.push_back({cell.position_W(child), cell.position_W(cell.parents[child]), child});
  if (segments_.empty()) return;
  boxes_.reserve(segments_.size());
  boxes_.emplace_back();
  build(0, 0, static_cast<std::uint32_t>(segments_.size()));
}

void SegmentTree::build(std::uint32_t box, std::uint32_t begin, std::uint32_t end) {
  Vector3d lo = Vector3d::Constant(std::numeric_limits<double>::infinity()), hi = -lo, centre_lo = lo, centre_hi = hi;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Segment& s = segments_[i];
    lo = lo.cwiseMin(s.child_W).cwiseMin(s.parent_W);
    hi = hi.cwiseMax(s.child_W).cwiseMax(s.parent_W);
    const Vector3d centre = s.child_W + s.parent_W;
    centre_lo = centre_lo.cwiseMin(centre);
    centre_hi = centre_hi.cwiseMax(centre);
  }
  boxes_[box] = {lo, hi, begin, end};
  if (end - begin <= kLeaf) return;
  Eigen::Index axis = 0;
  (centre_hi - centre_lo).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::uint32_t i) { return segments_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](const Segment& a, const Segment& b) {
    const double x = a.child_W[axis] + a.parent_W[axis], y = b.child_W[axis] + b.parent_W[axis];
    return x < y || (x == y && a.rank < b.rank);
  });
  const auto first = static_cast<std::uint32_t>(boxes_.size());
  boxes_.emplace_back();
  boxes_.emplace_back();
  boxes_[box].begin = first;
  boxes_[box].end = 0;
  build(first, begin, middle);
  build(first + 1, middle, end);
}

SegmentTree::Found SegmentTree::nearest(const Vector3d& h_W, double limit2_um2) const noexcept {
  Found found;
  if (boxes_.empty()) return found;
  struct Waiting {
    std::uint32_t box;
    double squared_distance;
  };
  // Each level halves the segments, so 32 levels hold any number of them; one box waits at each level.
  std::array<Waiting, 64> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, squaredDistance(boxes_[0].lo_W, boxes_[0].hi_W, h_W)};
  double best2 = limit2_um2;
  while (depth > 0) {
    const Waiting top = stack[--depth];
    if (top.squared_distance >= best2) continue;
    const Box& box = boxes_[top.box];
    if (box.end > 0) {
      for (std::uint32_t i = box.begin; i < box.end; ++i) {
        ++found.tested;
        const ClosestPoint q = closestPoint(segments_[i].child_W, segments_[i].parent_W, h_W);
        if (q.squared_distance < best2) {
          best2 = q.squared_distance;
          found.point = q;
          found.segment = segments_[i].rank;
        }
      }
      continue;
    }
    Waiting near{box.begin, squaredDistance(boxes_[box.begin].lo_W, boxes_[box.begin].hi_W, h_W)};
    Waiting far{box.begin + 1, squaredDistance(boxes_[box.begin + 1].lo_W, boxes_[box.begin + 1].hi_W, h_W)};
    if (far.squared_distance < near.squared_distance) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
  return found;
}

}  // namespace filiform::tools
