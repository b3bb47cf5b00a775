// TraceTree: the segments of one trace, to search. Isolated samples are segments without length. Thread rule: immutable
// after construction.
#pragma once

#include "index/query/cell_graph.h"
#include "index/tile/tile_engine.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace filiform::internal {

class TraceTree {
 public:
  struct Segment {
    std::array<Vector3d, 2> ends_W;
  };
  // Requires a sample. O(n log n).
  explicit TraceTree(const CellGraph& cell);

  // The distance from the point to the nearest segment. `near`: a segment that may be near; becomes the nearest one.
  // Requires near < segments().size().
  double distance_um(const Vector3d& p_W, std::uint32_t& near) const;
  // Calls `use` for each segment whose box meets this one.
  void forEachIn(const WorldBox& box, const std::function<void(const Segment& segment)>& use) const;
  const std::vector<Segment>& segments() const { return segments_; }

 private:
  // A node has the segments [begin, end); the first half of them is in the node after it, the others in `second`.
  struct Node {
    WorldBox box;
    std::uint32_t begin, end, second;  // second: 0 for a leaf
  };
  std::uint32_t build(std::uint32_t begin, std::uint32_t end);
  std::vector<Segment> segments_;
  std::vector<Node> nodes_;
};

}  // namespace filiform::internal
