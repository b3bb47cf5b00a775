#include "index/geometry/partition.h"

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <limits>
#include <utility>

namespace filiform {
namespace {

constexpr std::size_t kLeastPassage = 6;  // nodes; a shorter passage saves nothing
constexpr std::size_t kBetweenPassages = 4;

struct Pending {
  BlockKey block;
  std::size_t begin, end;  // range of the keys
  std::uint32_t parent;
  int side;
};

auto isLeaf(std::span<const MortonKey> sorted_midpoints, std::uint32_t capacity) {
  return [=](const BlockKey&, std::size_t begin, std::size_t end) {
    return end - begin <= capacity || sorted_midpoints[begin] == sorted_midpoints[end - 1];
  };
}

}  // namespace

GridBox closedBlock(const BlockKey& key) {
  GridBox box = key.box();
  box.hi.array() += 1;
  return box;
}

// Depth first, lower half first, so that leaves are ascending. The stack holds at most one pending half a level.
template <typename IsLeaf>
void Partition::build(const BlockKey& world, std::span<const MortonKey> keys, IsLeaf is_leaf) {
  std::vector<Pending> stack{{world, 0, keys.size(), kNone, 0}};
  while (!stack.empty()) {
    const Pending at = stack.back();
    stack.pop_back();
    const bool leaf = is_leaf(at.block, at.begin, at.end);
    const auto self = static_cast<std::uint32_t>(leaf ? leaves_.size() : nodes_.size());
    assert(self < kLeafBit);
    if (at.parent != kNone) nodes_[at.parent].child[at.side] = leaf ? self | kLeafBit : self;
    if (leaf) {
      leaves_.push_back(at.block);
      continue;
    }
    const BlockKey low = at.block.half(0), high = at.block.half(1);
    const int axis = at.block.depth % 3;
    nodes_.push_back({mortonPoint(high.low)[axis], {0, 0}, axis, kNone});
    const auto first = keys.begin() + static_cast<std::ptrdiff_t>(at.begin);
    const auto last = keys.begin() + static_cast<std::ptrdiff_t>(at.end);
    const auto middle = static_cast<std::size_t>(std::lower_bound(first, last, high.low) - keys.begin());
    stack.push_back({high, middle, at.end, self, 1});
    stack.push_back({low, at.begin, middle, self, 0});
  }
}

void Partition::findPassages() {
  constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max();
  std::vector<bool> passed(nodes_.size(), false);
  std::vector<std::pair<std::uint32_t, int>> way;         // nodes on the way, and the side that continues
  for (std::uint32_t at = 0; at < nodes_.size(); ++at) {  // parents come before their children
    if (passed[at]) continue;
    std::uint32_t end = at;
    for (way.clear();;) {
      const Node& node = nodes_[end];
      const bool low_is_leaf = (node.child[0] & kLeafBit) != 0, high_is_leaf = (node.child[1] & kLeafBit) != 0;
      if (low_is_leaf == high_is_leaf) break;
      passed[end] = true;
      way.emplace_back(end, low_is_leaf ? 1 : 0);
      end = node.child[way.back().second];
    }
    // Successive planes of an axis converge. So, seen from the end, the first plane on each side is the bound.
    Passage passage{GridPoint::Constant(-kFar), GridPoint::Constant(kFar), end};
    for (std::size_t i = way.size(); i-- > 0;) {
      const auto [number, side] = way[i];
      Node& node = nodes_[number];
      std::int64_t& bound = side == 1 ? passage.lo[node.axis] : passage.hi[node.axis];
      if (std::abs(bound) == kFar) bound = node.plane;
      // A segment that touches a plane may pass it later.
      if (i % kBetweenPassages != 0 || way.size() - i < kLeastPassage) continue;
      node.passage = static_cast<std::uint32_t>(passages_.size());
      passages_.push_back(passage);
    }
  }
}

Partition Partition::split(std::span<const MortonKey> sorted_midpoints, std::uint32_t capacity) {
  Partition p;
  p.build(BlockKey{}, sorted_midpoints, isLeaf(sorted_midpoints, capacity));
  p.findPassages();
  return p;
}

std::vector<BlockKey> Partition::splitBlock(const BlockKey& block, std::span<const MortonKey> sorted_midpoints,
                                            std::uint32_t capacity) {
  Partition p;
  p.build(block, sorted_midpoints, isLeaf(sorted_midpoints, capacity));
  return std::move(p.leaves_);
}

Partition::Partition(std::vector<BlockKey> leaves) {
  std::vector<MortonKey> lows;
  lows.reserve(leaves.size());
  for (const BlockKey& leaf : leaves) lows.push_back(leaf.low);
  build(BlockKey{}, lows, [&](const BlockKey& block, std::size_t begin, std::size_t end) {
    assert(begin < end && leaves[begin].depth >= block.depth);
    return end - begin == 1 && leaves[begin].depth <= block.depth;
  });
  assert(leaves_ == leaves);
  findPassages();
}

std::uint32_t Partition::home(const GridPoint& p) const { return descend(root(), p); }

std::uint32_t Partition::descend(std::uint32_t at, const GridPoint& p) const {
  while (!(at & kLeafBit)) {
    const Node& node = nodes_[at];
    if (node.passage != kNone) {
      const Passage& way = passages_[node.passage];
      if ((p.array() >= way.lo.array()).all() && (p.array() < way.hi.array()).all()) {
        at = way.end;
        continue;
      }
    }
    at = node.child[p[node.axis] >= node.plane];
  }
  return at & ~kLeafBit;
}

std::vector<Partition::Subtree> Partition::path(const BlockKey& block) const {
  const GridPoint low = mortonPoint(block.low);
  std::uint32_t at = root();
  BlockKey reached;
  std::vector<Subtree> path{{at, closedBlock(reached)}};
  while (reached.depth < block.depth && !(at & kLeafBit)) {
    const Node& node = nodes_[at];
    const int upper = low[node.axis] >= node.plane;
    at = node.child[upper];
    reached = reached.half(upper);
    path.push_back({at, closedBlock(reached)});
  }
  return path;
}

// Walks to the leaves that a segment meets. An exact test is needed only if the segment's box touches a plane and the
// segment leaves the block.
class Partition::Visit {
 public:
  Visit(const Partition& partition, const GridBox& block, const GridPoint& a, const GridPoint& b,
        std::vector<std::uint32_t>& met)
      : partition_(partition), a_(a), b_(b), low_(a.cwiseMin(b)), high_(a.cwiseMax(b)), box_(block), met_(met) {}

  bool run(std::uint32_t root) {
    return descend(root, (low_.array() >= box_.lo.array()).all() && (high_.array() <= box_.hi.array()).all());
  }
  std::uint64_t visited() const { return visited_; }

 private:
  // `whole`: the segment lies in the block. Changes box_, and does not restore it.
  bool descend(std::uint32_t at, bool whole) {
    for (;;) {
      ++visited_;
      if (at & kLeafBit) {
        met_.push_back(at & ~kLeafBit);
        return met_.size() <= kMaxLeavesOfSegment;
      }
      const Node& node = partition_.nodes_[at];
      if (node.passage != kNone) {
        const Passage& way = partition_.passages_[node.passage];
        if ((low_.array() > way.lo.array()).all() && (high_.array() < way.hi.array()).all()) {
          box_.lo = box_.lo.cwiseMax(way.lo);
          box_.hi = box_.hi.cwiseMin(way.hi);
          at = way.end;
          continue;
        }
      }
      if (high_[node.axis] < node.plane) {
        box_.hi[node.axis] = node.plane;
        at = node.child[0];
      } else if (low_[node.axis] > node.plane) {
        box_.lo[node.axis] = node.plane;
        at = node.child[1];
      } else {
        const GridBox both = box_;
        box_.hi[node.axis] = node.plane;
        if ((whole || segmentMeetsBox(a_, b_, box_)) &&
            !descend(node.child[0], whole && high_[node.axis] <= node.plane))
          return false;
        box_ = both;
        box_.lo[node.axis] = node.plane;
        if (!whole && !segmentMeetsBox(a_, b_, box_)) return true;
        whole = whole && low_[node.axis] >= node.plane;
        at = node.child[1];
      }
    }
  }

  const Partition& partition_;
  const GridPoint a_, b_, low_, high_;
  GridBox box_;
  std::vector<std::uint32_t>& met_;
  std::uint64_t visited_ = 0;
};

bool Partition::leavesMet(const GridPoint& a, const GridPoint& b, std::vector<std::uint32_t>& met,
                          std::uint64_t* visited) const {
  return leavesMet({root(), closedBlock(BlockKey{})}, a, b, met, visited);
}

bool Partition::leavesMet(const Subtree& from, const GridPoint& a, const GridPoint& b, std::vector<std::uint32_t>& met,
                          std::uint64_t* visited) const {
  met.clear();
  Visit visit(*this, from.block, a, b, met);
  const bool few = visit.run(from.root);
  if (visited != nullptr) *visited += visit.visited();
  return few;
}

}  // namespace filiform
