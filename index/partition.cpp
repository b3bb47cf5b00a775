#include "index/partition.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace filiform {
namespace {

struct Pending {
  CellKey cell;
  std::size_t begin, end;  // of the keys
  std::uint32_t parent;
  int side;
};

auto isLeaf(std::span<const MortonKey> sorted_midpoints, std::uint32_t capacity) {
  return [=](const CellKey&, std::size_t begin, std::size_t end) {
    return end - begin <= capacity || sorted_midpoints[begin] == sorted_midpoints[end - 1];
  };
}

}  // namespace

GridPoint midpoint(const GridPoint& a, const GridPoint& b) {
  const GridPoint sum = a + b;
  return {sum.x() >> 1, sum.y() >> 1, sum.z() >> 1};
}

GridBox closedCell(const CellKey& key) {
  GridBox box = key.box();
  box.hi.array() += 1;
  return box;
}

// Depth first, lower half first, so that leaves come in ascending order. The stack holds at most one pending half a
// level.
template <typename IsLeaf>
void Partition::build(const CellKey& world, std::span<const MortonKey> keys, IsLeaf is_leaf) {
  constexpr std::uint32_t kNone = UINT32_MAX;
  std::vector<Pending> stack{{world, 0, keys.size(), kNone, 0}};
  while (!stack.empty()) {
    const Pending at = stack.back();
    stack.pop_back();
    const bool leaf = is_leaf(at.cell, at.begin, at.end);
    const auto self = static_cast<std::uint32_t>(leaf ? leaves_.size() : nodes_.size());
    assert(self < kLeafBit);
    if (at.parent != kNone) nodes_[at.parent].child[at.side] = leaf ? self | kLeafBit : self;
    if (leaf) {
      leaves_.push_back(at.cell);
      continue;
    }
    const CellKey low = at.cell.half(0), high = at.cell.half(1);
    const int axis = at.cell.depth % 3;
    nodes_.push_back({mortonPoint(high.low)[axis], {0, 0}, axis});
    const auto first = keys.begin() + static_cast<std::ptrdiff_t>(at.begin);
    const auto last = keys.begin() + static_cast<std::ptrdiff_t>(at.end);
    const auto middle = static_cast<std::size_t>(std::lower_bound(first, last, high.low) - keys.begin());
    stack.push_back({high, middle, at.end, self, 1});
    stack.push_back({low, at.begin, middle, self, 0});
  }
}

Partition Partition::split(std::span<const MortonKey> sorted_midpoints, std::uint32_t capacity) {
  Partition p;
  p.build(CellKey{}, sorted_midpoints, isLeaf(sorted_midpoints, capacity));
  return p;
}

std::vector<CellKey> Partition::splitCell(const CellKey& cell, std::span<const MortonKey> sorted_midpoints,
                                          std::uint32_t capacity) {
  Partition p;
  p.build(cell, sorted_midpoints, isLeaf(sorted_midpoints, capacity));
  return std::move(p.leaves_);
}

Partition::Partition(std::vector<CellKey> leaves) {
  std::vector<MortonKey> lows;
  lows.reserve(leaves.size());
  for (const CellKey& leaf : leaves) lows.push_back(leaf.low);
  build(CellKey{}, lows, [&](const CellKey& cell, std::size_t begin, std::size_t end) {
    assert(begin < end && leaves[begin].depth >= cell.depth);
    return end - begin == 1 && leaves[begin].depth <= cell.depth;
  });
  assert(leaves_ == leaves);
}

std::uint32_t Partition::home(const GridPoint& p) const { return descend(root(), p); }

std::uint32_t Partition::descend(std::uint32_t at, const GridPoint& p) const {
  while (!(at & kLeafBit)) {
    const Node& node = nodes_[at];
    at = node.child[p[node.axis] >= node.plane];
  }
  return at & ~kLeafBit;
}

Partition::Subtree Partition::subtree(const CellKey& cell) const {
  const GridPoint low = mortonPoint(cell.low);
  std::uint32_t at = root();
  CellKey reached;
  while (reached.depth < cell.depth && !(at & kLeafBit)) {
    const Node& node = nodes_[at];
    const int upper = low[node.axis] >= node.plane;
    at = node.child[upper];
    reached = reached.half(upper);
  }
  return {at, closedCell(reached)};
}

bool Partition::leavesMet(const GridPoint& a, const GridPoint& b, std::vector<std::uint32_t>& met) const {
  return leavesMet({root(), closedCell(CellKey{})}, a, b, met);
}

bool Partition::leavesMet(const Subtree& from, const GridPoint& a, const GridPoint& b,
                          std::vector<std::uint32_t>& met) const {
  met.clear();
  // Down to the first plane that the segment's box touches, no exact test is needed.
  const GridPoint low = a.cwiseMin(b), high = a.cwiseMax(b);
  GridBox cell = from.cell;
  std::uint32_t at = from.root;
  while (!(at & kLeafBit)) {
    const Node& node = nodes_[at];
    if (high[node.axis] < node.plane) {
      cell.hi[node.axis] = node.plane;
      at = node.child[0];
    } else if (low[node.axis] > node.plane) {
      cell.lo[node.axis] = node.plane;
      at = node.child[1];
    } else {
      break;
    }
  }
  // Beyond it a test is needed only where the segment's box touches a plane again, and the segment leaves the cell.
  // One box, changed on the way down and restored on the way up: nothing is copied.
  const auto descend = [&](const auto& self, std::uint32_t number, bool whole) -> bool {  // whole: it lies in the cell
    if (number & kLeafBit) {
      met.push_back(number & ~kLeafBit);
      return met.size() <= kMaxLeavesOfSegment;
    }
    const Node& node = nodes_[number];
    const bool below = low[node.axis] <= node.plane, above = high[node.axis] >= node.plane;
    const bool sure = whole || !below || !above;
    if (below) {
      const std::int64_t hi = std::exchange(cell.hi[node.axis], node.plane);
      if ((sure || segmentMeetsBox(a, b, cell)) && !self(self, node.child[0], whole && high[node.axis] <= node.plane))
        return false;
      cell.hi[node.axis] = hi;
    }
    if (above) {
      const std::int64_t lo = std::exchange(cell.lo[node.axis], node.plane);
      if ((sure || segmentMeetsBox(a, b, cell)) && !self(self, node.child[1], whole && low[node.axis] >= node.plane))
        return false;
      cell.lo[node.axis] = lo;
    }
    return true;
  };
  return descend(descend, at, (low.array() >= cell.lo.array()).all() && (high.array() <= cell.hi.array()).all());
}

}  // namespace filiform
