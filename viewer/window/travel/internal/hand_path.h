// The path of a simulated hand along neurites, and the point on it at which the hand aims. Thread rule: one owner.
#pragma once

#include "index/geometry/grid.h"

#include <cstddef>
#include <vector>

namespace filiform::internal {

class HandPath {
 public:
  // Requires two points at least.
  void begin(std::vector<Vector3d> path_W);
  void end() { path_W_.clear(); }
  bool isUnderWay() const { return !path_W_.empty(); }

  // Returns the point that lies `ahead_um` farther along the path than its point nearest to the proxy. Ends the path
  // when the proxy is within ahead_um / 10 of its last point. Requires isUnderWay().
  Vector3d aim_W(const Vector3d& p_W, double ahead_um);

 private:
  std::vector<Vector3d> path_W_;
  std::size_t at_ = 0;  // the segment of the path nearest to the proxy; never falls
};

}  // namespace filiform::internal
