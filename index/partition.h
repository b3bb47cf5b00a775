// Where the cuts of a tile set lie: binary splits of the world along Morton prefixes until a cell holds few enough
// midpoints.
//
// The leaves are a pure function of the set of midpoints and the capacity: they do not depend on the order of arrival,
// on threads or on memory. They cover the whole world; a tile set keeps only those that store something. Immutable
// after construction: any number of threads may read.
#pragma once

#include "index/morton.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform {

struct PartitionOptions {
  std::uint32_t capacity = 2048;  // owned segments a tile, at least 1; cells that cannot be split may hold more
  int quantum_exponent = Grid::kDefaultExponent;  // of the grid, see grid.h
};

// A segment that meets more leaves than this is stored in the homes of its two ends and in the long-segment tile,
// nowhere else.
inline constexpr std::size_t kMaxLeavesOfSegment = 64;

// The point whose leaf owns the segment a-b: the middle, rounded down on each axis. Does not depend on the direction.
GridPoint midpoint(const GridPoint& a, const GridPoint& b);

// The closed cell: from the lowest grid point of the cell to the lowest of the next one (hi + 1) on each axis, so that
// neighbouring closed cells share a face and together leave no gap. A tile stores what meets its closed cell.
GridBox closedCell(const CellKey& key);

class Partition {
 public:
  // Splits until a cell holds at most `capacity` midpoints, or all of its midpoints are equal. Requires ascending keys
  // and capacity > 0. O(leaves * log n).
  static Partition split(std::span<const MortonKey> sorted_midpoints, std::uint32_t capacity);

  // The leaves of a part of the world, given all midpoints in it, where the whole partition splits everything above it.
  static std::vector<CellKey> splitCell(const CellKey& cell, std::span<const MortonKey> sorted_midpoints,
                                        std::uint32_t capacity);

  // The partition with these leaves. Requires that they are disjoint, ascending and cover the world. O(leaves).
  explicit Partition(std::vector<CellKey> leaves);

  const std::vector<CellKey>& leaves() const { return leaves_; }
  // Position in leaves() of the leaf that contains the point. O(depth).
  std::uint32_t home(const GridPoint& p) const;
  // Clears `met`, then appends the position of every leaf whose closed cell meets the closed segment, ascending; exact.
  // False, with `met` cut short, when there are more than kMaxLeavesOfSegment. Adds to `visited`, if given, how many
  // nodes were looked at. O(leaves met * depth), where a way without branches through empty space counts as one.
  bool leavesMet(const GridPoint& a, const GridPoint& b, std::vector<std::uint32_t>& met,
                 std::uint64_t* visited = nullptr) const;

  // A cell of the tree, to start from instead of the whole world.
  struct Subtree {
    std::uint32_t root;
    GridBox cell;  // closed
  };
  // That cell, or the leaf that holds it. O(depth).
  Subtree subtree(const CellKey& cell) const;
  // As home(), for a point inside the cell.
  std::uint32_t home(const Subtree& from, const GridPoint& p) const { return descend(from.root, p); }
  // As leavesMet(), for a segment that meets no closed cell outside of `from`.
  bool leavesMet(const Subtree& from, const GridPoint& a, const GridPoint& b, std::vector<std::uint32_t>& met,
                 std::uint64_t* visited = nullptr) const;

 private:
  Partition() = default;
  template <typename IsLeaf>
  void build(const CellKey& world, std::span<const MortonKey> keys, IsLeaf is_leaf);

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
    std::uint32_t passage;  // that begins here, or kNone
  };
  // A way down past nodes that have a leaf on one side: a few cells in a wide world lie at the end of many such nodes.
  struct Passage {
    GridPoint lo, hi;  // what lies between them, on no face, passes all the nodes on the way
    std::uint32_t end;
  };
  std::vector<Node> nodes_;  // the first is the root, unless the world is one leaf
  std::vector<Passage> passages_;
  std::vector<CellKey> leaves_;
};

}  // namespace filiform
