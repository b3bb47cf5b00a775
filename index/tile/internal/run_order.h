// The order of a tile's runs in its search tree.
#pragma once

#include "index/geometry/grid.h"
#include "index/tile/tile.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform::internal {

inline constexpr std::uint32_t kRunSegments = 4;  // the limit of a run here; SegmentRun could count to 8
inline constexpr std::uint32_t kTreeWidth = 8;

// Cuts `count` segments from `begin` on into the fewest runs, of nearly equal length.
inline void appendRuns(std::uint32_t begin, std::uint32_t count, std::vector<SegmentRun>& runs) {
  const std::uint64_t pieces = (std::uint64_t{count} + kRunSegments - 1) / kRunSegments;
  std::uint32_t from = 0;
  for (std::uint64_t i = 1; i <= pieces; ++i) {
    const auto to = static_cast<std::uint32_t>(i * count / pieces);
    runs.push_back({8 * (begin + from) + (to - from - 1)});
    from = to;
  }
}

// The order in which items with these centres form compact groups of 8, 64 and so on, as positions in `centres`. Splits
// at the median along the longest side, at multiples of the group's size. Depends only on the centres. O(n log n).
std::vector<std::uint32_t> orderRuns(std::span<const GridPoint> centres);

}  // namespace filiform::internal
