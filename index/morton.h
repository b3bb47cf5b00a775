// Keys of the binary space partition.
//
// A MortonKey interleaves the three grid coordinates, 42 bits each, offset by 2^41 so that they are unsigned; from the
// top bit down the axes alternate x, y, z, x, ... A CellKey is a prefix of such keys: `depth` leading bits. Depth 0 is
// the whole world, one bit more halves the cell along the next axis, three bits more make an octree level. Cells at
// equal depth, and the leaves of any partition, are ordered by their lowest key; a cell contains exactly the keys in
// [low, high]. Immutable values, O(1) throughout.
#pragma once

#include "index/grid.h"

#include <compare>
#include <cstdint>

namespace filiform {

__extension__ using MortonKey = unsigned __int128;

inline constexpr int kMortonAxisBits = 42;
inline constexpr int kMortonBits = 3 * kMortonAxisBits;

// Requires -2^41 <= p < 2^41 on each axis.
MortonKey mortonKey(const GridPoint& p);
GridPoint mortonPoint(MortonKey key);  // the inverse

struct CellKey {
  MortonKey low = 0;  // lowest key in the cell: bits below the prefix are zero
  int depth = 0;      // number of leading bits fixed, 0..kMortonBits

  MortonKey high() const { return depth == kMortonBits ? low : low | ((MortonKey{1} << (kMortonBits - depth)) - 1); }
  bool contains(MortonKey key) const { return key >= low && key <= high(); }
  CellKey half(int bit) const {  // Requires depth < kMortonBits
    return {low | (MortonKey(bit) << (kMortonBits - depth - 1)), depth + 1};
  }
  GridBox box() const;  // grid points of the cell: lo and hi both inside
  bool operator==(const CellKey&) const = default;
};

// Position of the cell's centre along a three-dimensional Hilbert curve over the same 42-bit cube: neighbours on the
// curve are neighbours in space. Used to order tiles in packs.
MortonKey hilbertIndex(const GridPoint& p);

// Does the closed segment a-b meet the closed box? Exact in integers (separating axes), never misses.
bool segmentMeetsBox(const GridPoint& a, const GridPoint& b, const GridBox& box);

}  // namespace filiform
