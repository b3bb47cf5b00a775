// Keys of the binary space partition.
//
// A MortonKey interleaves the bits of the three grid coordinates, 42 bits each. 2^41 is added to each coordinate first,
// so that it is not negative. From the key's highest bit (125) down, the axes alternate x, y, z, x, ... A BlockKey
// names a block: all keys with the same first `depth` bits. Depth 0 is the whole grid. One more bit halves the block
// along the next axis; three more bits make an octree level.
//
// A block contains exactly the keys in [low, high]. Blocks of equal depth, and the leaves of any partition, are ordered
// by their lowest key. Requirements are not checked. Thread rule: plain values. O(1) throughout.
#pragma once

#include "index/geometry/grid.h"

#include <array>
#include <compare>
#include <cstdint>

namespace filiform {

__extension__ using MortonKey = unsigned __int128;

inline constexpr int kMortonAxisBits = 42;
inline constexpr int kMortonBits = 3 * kMortonAxisBits;

// The key of a grid point. Requires -2^41 <= p < 2^41 on each axis.
MortonKey mortonKey(const GridPoint& p);
// The same, faster for points that lie near the one before. Thread rule: thread-compatible.
class MortonKeys {
 public:
  MortonKey of(const GridPoint& p);

 private:
  std::array<std::uint64_t, 3> upper_{};  // the upper half of the last point's bits, by axis
  MortonKey high_ = 0;                    // what they make of a key
};
GridPoint mortonPoint(MortonKey key);  // the inverse

// A block of the partition.
struct BlockKey {
  MortonKey low = 0;  // lowest key in the block: the bits after the first `depth` ones are zero
  int depth = 0;      // 0..kMortonBits

  MortonKey high() const { return depth == kMortonBits ? low : low | ((MortonKey{1} << (kMortonBits - depth)) - 1); }
  bool contains(MortonKey key) const { return key >= low && key <= high(); }
  BlockKey half(int bit) const {  // bit 0: lower half, 1: upper. Requires depth < kMortonBits
    return {low | (MortonKey(bit) << (kMortonBits - depth - 1)), depth + 1};
  }
  GridBox box() const;  // grid points of the block, lo and hi included
  bool operator==(const BlockKey&) const = default;
};

// True if the closed segment a-b meets the closed box; touching counts, and a == b is a point. Exact: by the
// separating-axis test in integers. Requires -2^41 <= p < 2^41 of all points.
bool segmentMeetsBox(const GridPoint& a, const GridPoint& b, const GridBox& box);

}  // namespace filiform
