// The way of a simulated hand along threads, and where on it the hand aims. Thread rule: one owner.
#pragma once

#include "index/geometry/grid.h"

#include <cstddef>
#include <vector>

namespace filiform::internal {

class HandPath {
 public:
  // Requires two points at least.
  void begin(std::vector<Vector3d> way_W);
  void end() { way_W_.clear(); }
  bool isUnderWay() const { return !way_W_.empty(); }

  // That far along the way from the point of it that is nearest to the proxy. Ends the tour where the proxy is within a
  // tenth of that of the way's end. Requires isUnderWay().
  Vector3d aim_W(const Vector3d& p_W, double ahead_um);

 private:
  std::vector<Vector3d> way_W_;
  std::size_t at_ = 0;  // the segment of the way that the proxy is next to: it does not go back
};

}  // namespace filiform::internal
