// The partition of a tile set: binary splits of the world along Morton prefixes, until each block holds few enough
// midpoints.
//
// The leaves are the undivided blocks. They depend only on the set of midpoints and the capacity, not on the order of
// arrival, threads or memory. They cover the whole world; a tile set stores only leaves with content. Thread rule:
// immutable after construction; any number of threads may read.
#pragma once

#include "index/geometry/morton.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

struct PartitionOptions {
  std::uint32_t capacity = 2048;  // owned segments a tile, at least 1; blocks that cannot be split may hold more
  int quantum_exponent = Grid::kDefaultExponent;  // of the grid, see grid.h
};

// A segment that meets more leaves than this is a long segment. It is stored only in the homes of its two ends and in
// the long-segment tile.
inline constexpr std::size_t kMaxLeavesOfSegment = 64;

// The point that decides which leaf owns the segment a-b: its middle, rounded down on each axis. Independent of
// direction.
inline GridPoint midpoint(const GridPoint& a, const GridPoint& b) {
  return {(a[0] + b[0]) >> 1, (a[1] + b[1]) >> 1, (a[2] + b[2]) >> 1};
}

// The closed block: from the block's lowest grid point to the next block's lowest (hi + 1), on each axis. Neighbouring
// closed blocks share a face, without a gap. A tile stores every segment that meets its closed block.
GridBox closedBlock(const BlockKey& key);

class Partition {
 public:
  // Splits the world until each block holds at most `capacity` midpoints, or only equal midpoints. Requires ascending
  // keys and capacity > 0. O(leaves * log n).
  static Partition split(std::span<const MortonKey> sorted_midpoints, std::uint32_t capacity);

  // The leaves inside `block`, from all midpoints in it. Requires that the whole partition splits every block above
  // `block`.
  static std::vector<BlockKey> splitBlock(const BlockKey& block, std::span<const MortonKey> sorted_midpoints,
                                          std::uint32_t capacity);

  // The partition with the given leaves. Requires leaves that are disjoint, ascending and cover the world. O(leaves).
  explicit Partition(std::vector<BlockKey> leaves);

  const std::vector<BlockKey>& leaves() const { return leaves_; }
  // Position in leaves() of the leaf that contains the point. O(depth).
  std::uint32_t home(const GridPoint& p) const;
  // Replaces `met` with the positions of all leaves whose closed block meets the closed segment, ascending; exact.
  // Returns false, with `met` incomplete, for more than kMaxLeavesOfSegment leaves. Adds the number of visited nodes to
  // `visited`, if given. O(leaves met * depth); a path without branches through empty space counts as one step.
  bool leavesMet(const GridPoint& a, const GridPoint& b, std::vector<std::uint32_t>& met,
                 std::uint64_t* visited = nullptr) const;

  // A block of the tree, from which searches may start instead of the whole world.
  struct Subtree {
    std::uint32_t root;
    GridBox block;  // closed
  };
  // The subtrees that contain `block`, from the whole tree to that of `block`, or of the leaf that contains it.
  // O(depth).
  std::vector<Subtree> path(const BlockKey& block) const;
  // Like home(p), for a point inside the block.
  std::uint32_t home(const Subtree& from, const GridPoint& p) const { return descend(from.root, p); }
  // Like leavesMet(a, b), for a segment that meets no closed block outside `from`.
  bool leavesMet(const Subtree& from, const GridPoint& a, const GridPoint& b, std::vector<std::uint32_t>& met,
                 std::uint64_t* visited = nullptr) const;

 private:
  Partition() = default;
  template <typename IsLeaf>
  void build(const BlockKey& world, std::span<const MortonKey> keys, IsLeaf is_leaf);

  void findPassages();
  std::uint32_t descend(std::uint32_t at, const GridPoint& p) const;
  class Visit;
  std::uint32_t root() const { return nodes_.empty() ? kLeafBit : 0; }

  static constexpr std::uint32_t kLeafBit = std::uint32_t{1} << 31;
  static constexpr std::uint32_t kNone = UINT32_MAX;
  struct Node {
    std::int64_t plane;      // lowest coordinate of the upper half
    std::uint32_t child[2];  // position in nodes_, or kLeafBit | position in leaves_
    std::int32_t axis;
    std::uint32_t passage;  // the passage that begins here, or kNone
  };
  // A shortcut past consecutive nodes that each have a leaf on one side. In a wide world, a few blocks lie below many
  // such nodes.
  struct Passage {
    GridPoint lo, hi;  // a segment strictly between them passes all nodes on the way
    std::uint32_t end;
  };
  std::vector<Node> nodes_;  // the first is the root, unless the world is one leaf
  std::vector<Passage> passages_;
  std::vector<BlockKey> leaves_;
};

}  // namespace filiform
