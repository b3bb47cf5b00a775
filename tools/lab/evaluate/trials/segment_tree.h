// Finds the nearest segment of one tree of one cell, exactly. The nearest-point oracle and the judgement of stuck
// proxies use it. Holds everything in memory, without bounds: for comparison only. Immutable after construction: any
// number of threads may read.
#pragma once

#include "index/geometry/closest_point.h"
#include "index/query/cell_graph.h"

#include <cstdint>
#include <vector>

namespace filiform::tools {

class SegmentTree {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  struct Found {
    std::uint32_t segment = kNone;  // rank of its child; kNone: no segment is nearer than the limit
    ClosestPoint point{};
    std::uint32_t tested = 0;  // number of segments
  };

  // Builds the tree over the segments with these children (ranks). O(n log n).
  SegmentTree(const CellGraph& cell, const std::vector<std::uint32_t>& children);

  // Returns the nearest point to h among those nearer than the square root of `limit2_um2`. Deterministic. Usually
  // O(log n). Requires finite h.
  Found nearest(const Vector3d& h_W, double limit2_um2) const noexcept;

 private:
  struct Box {
    Vector3d lo_W, hi_W;
    std::uint32_t begin, end;  // leaf: positions in segments_; else `end` is 0 and the children are begin, begin + 1
  };
  struct Segment {
    Vector3d child_W, parent_W;
    std::uint32_t rank;
  };
  void build(std::uint32_t box, std::uint32_t begin, std::uint32_t end);

  std::vector<Segment> segments_;
  std::vector<Box> boxes_;
};

}  // namespace filiform::tools
