#include "viewer/window/travel/internal/hand_path.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace filiform::internal {

void HandPath::begin(std::vector<Vector3d> path_W) {
  path_W_ = std::move(path_W);
  at_ = 0;
}

Vector3d HandPath::aim_W(const Vector3d& p_W, double ahead_um) {
  double best_um = INFINITY, along = 0, passed_um = 0;
  std::size_t at = at_;
  // The path may come back to the same place later. Search only as far ahead as the hand can be, to cut nothing short.
  for (std::size_t i = at_; i + 1 < path_W_.size() && passed_um < 4 * ahead_um; ++i) {
    const Vector3d d = path_W_[i + 1] - path_W_[i];
    const double t = d.squaredNorm() > 0 ? std::clamp((p_W - path_W_[i]).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
    const double distance_um = (path_W_[i] + t * d - p_W).norm();
    if (distance_um < best_um) {
      best_um = distance_um;
      at = i;
      along = t;
    }
    passed_um += (i == at_ ? 1 - t : 1) * d.norm();
  }
  at_ = at;
  Vector3d aim = path_W_[at] + along * (path_W_[at + 1] - path_W_[at]);
  double left_um = ahead_um;
  for (std::size_t i = at; i + 1 < path_W_.size() && left_um > 0; ++i) {
    const Vector3d step = path_W_[i + 1] - aim;
    const double length_um = step.norm();
    if (length_um >= left_um) return aim + step * (left_um / length_um);
    left_um -= length_um;
    aim = path_W_[i + 1];
  }
  if ((p_W - path_W_.back()).norm() < 0.1 * ahead_um) end();
  return aim;
}

}  // namespace filiform::internal
