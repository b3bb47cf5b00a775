#include "index/query/internal/box_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filiform::internal {
namespace {

// Far beyond every grid; the square of a distance is still finite in float.
constexpr double kFar_um = 1e18;

// At most two steps of float further than necessary.
float roundedDown(double v) {
  const auto rounded = static_cast<float>(v);
  return rounded - std::abs(rounded) * 0x1p-23f;
}
float roundedUp(double v) { return -roundedDown(-v); }

}  // namespace

BoxLevels::BoxLevels(const std::vector<WorldBox>& boxes) {
  if (boxes.empty()) return;
  WorldBox all = boxes[0];
  for (const WorldBox& box : boxes) {
    all.lo_W = all.lo_W.cwiseMin(box.lo_W);
    all.hi_W = all.hi_W.cwiseMax(box.hi_W);
  }
  origin_W_ = 0.5 * (all.lo_W + all.hi_W);
  size_um_ = all.lo_W.cwiseAbs().cwiseMax(all.hi_W.cwiseAbs()).maxCoeff();
  std::uint32_t nodes = 0;
  for (auto count = static_cast<std::uint32_t>(boxes.size());;) {
    levels_.push_back({nodes, count});
    count = (count + kWidth - 1) / kWidth;
    nodes += count;
    if (count == 1) break;
  }
  Node nothing;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (std::size_t axis = 0; axis < 3; ++axis) nothing.lo[axis].fill(kInfinity), nothing.hi[axis].fill(-kInfinity);
  nodes_.resize(nodes, nothing);
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      nodes_[i / kWidth].lo[axis][i % kWidth] = roundedDown(boxes[i].lo_W[a] - origin_W_[a]);
      nodes_[i / kWidth].hi[axis][i % kWidth] = roundedUp(boxes[i].hi_W[a] - origin_W_[a]);
    }
  for (std::size_t level = 1; level < levels_.size(); ++level)
    for (std::uint32_t i = 0; i < levels_[level].children; ++i) {
      const Node& below = nodes_[levels_[level - 1].begin + i];
      Node& node = nodes_[levels_[level].begin + i / kWidth];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        node.lo[axis][i % kWidth] = *std::min_element(below.lo[axis].begin(), below.lo[axis].end());
        node.hi[axis][i % kWidth] = *std::max_element(below.hi[axis].begin(), below.hi[axis].end());
      }
    }
}

BoxLevels::Probe BoxLevels::probe(const Vector3d& h_W) const {
  constexpr double kUlps = 64 * std::numeric_limits<double>::epsilon();
  const double slack = kUlps * (h_W.cwiseAbs().maxCoeff() + size_um_);
  Probe probe;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double at = h_W[a] - origin_W_[a];
    probe.lo[axis] = roundedDown(std::clamp(at - slack, -kFar_um, kFar_um));
    probe.hi[axis] = roundedUp(std::clamp(at + slack, -kFar_um, kFar_um));
  }
  return probe;
}

void BoxLevels::squaredBelow(const Probe& probe, Place at, Bounds& squared) const {
  const Node& node = nodeAt(at);
  std::array<std::array<float, kWidth>, 3> gaps;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float lo = probe.lo[axis], hi = probe.hi[axis];
    for (std::uint32_t i = 0; i < kWidth; ++i) {
      const float below = node.lo[axis][i] - hi, above = lo - node.hi[axis][i];
      const float gap = below > above ? below : above;
      gaps[axis][i] = gap > 0 ? gap : 0;
    }
  }
  const auto& [x, y, z] = gaps;
  for (std::uint32_t i = 0; i < kWidth; ++i) {
    const float sum = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
    squared[i] = Bound(sum * (1 - 0x1p-20f), i);  // the factor covers the rounding of all steps
  }
}

WorldBox BoxLevels::boxOf(Place at, std::uint32_t i) const {
  const Node& node = nodeAt(at);
  constexpr double kUlps = 4 * std::numeric_limits<double>::epsilon();
  const Vector3d slack = Vector3d::Constant(kUlps * size_um_);
  return {origin_W_ + Vector3d(node.lo[0][i], node.lo[1][i], node.lo[2][i]) - slack,
          origin_W_ + Vector3d(node.hi[0][i], node.hi[1][i], node.hi[2][i]) + slack};
}

}  // namespace filiform::internal
