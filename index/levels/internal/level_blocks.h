// Which blocks of the octree get level tiles, and how fine their leaves' neurites must be.
#pragma once

#include "index/geometry/grid.h"
#include "index/geometry/morton.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace filiform::internal {

// Tolerances of the edge of a block, with level tiles below and without.
inline constexpr double kParts = 512, kFirstParts = 256;

// A run of neighbouring leaves in one octree block.
struct LeafRange {
  std::size_t begin, end;
};

// The octree over leaves with content. Thread rule: immutable after construction.
class LevelBlocks {
 public:
  // `segments`: owned by each leaf. Keeps references to `leaves`. A block below the outermost has a level in two cases:
  // - its depth is a multiple of 6, and it holds `least_segments` and 4 times the segments of each level inside;
  // - its depth is another multiple of 3, it holds 2 `least_segments`, and no level is inside.
  // O(leaves).
  LevelBlocks(std::span<const BlockKey> leaves, std::span<const std::uint32_t> segments, std::uint64_t least_segments);

  std::size_t size() const { return leaves_.size(); }
  // A level is stored in blocks that show at most about so many segments in the tiles below.
  std::uint64_t cutSegments() const { return std::max<std::uint64_t>(least_ / 8, 1); }
  const BlockKey& leaf(std::size_t at) const { return leaves_[at]; }
  std::uint64_t segments(const LeafRange& range) const { return before_[range.end] - before_[range.begin]; }

  // The smallest octree block that contains all leaves of the range, at least two. O(1).
  BlockKey block(const LeafRange& range) const;
  // The smallest block of any depth that contains all leaves of the range: the leaf's, if it is one. O(1).
  BlockKey tightBlock(const LeafRange& range) const;
  // Those leaves from `begin` on that lie in one block of the next octree level below `depth`. O(leaves of it).
  LeafRange part(std::size_t begin, std::size_t end, int depth) const;
  bool isOutermost(const LeafRange& range) const { return range.begin == 0 && range.end == leaves_.size(); }
  bool hasLevel(const LeafRange& range, const BlockKey& block) const;  // O(leaves * depth)
  // True if no block inside has a level. O(leaves * depth).
  bool isFirst(const LeafRange& range) const { return largestInside(range) == 0; }

 private:
  bool hasLevel(const LeafRange& range, const BlockKey& block, std::uint64_t largest_inside) const;
  std::uint64_t largestInside(const LeafRange& range) const;  // segments of blocks with a level

  std::span<const BlockKey> leaves_;
  std::vector<std::uint64_t> before_;  // segments of all leaves before
  std::uint64_t least_;
};

// The tolerance for the neurites of each leaf, um: that of the smallest block with a level around it. Leaves without
// segments get 0. `bounds`: of all nodes. O(leaves * depth).
std::vector<float> leafTolerances_um(std::span<const BlockKey> leaves, std::span<const std::uint32_t> segments,
                                     std::uint64_t least_segments, const Grid& grid, const GridBox& bounds);

// The smaller of a block's edge and the largest extent of its content, um.
double extentOf_um(const BlockKey& block, const GridBox& content, const Grid& grid);

}  // namespace filiform::internal
