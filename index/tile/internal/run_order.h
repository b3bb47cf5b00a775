// The order of a tile's runs in its search tree.
#pragma once

#include "index/geometry/grid.h"
#include "index/tile/segment_run.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform::internal {

inline constexpr std::uint32_t kRunSegments = 4;  // the limit of a run here; SegmentRun could count to 8
inline constexpr std::uint32_t kTreeWidth = 8;

// The number of runs of a fragment.
inline std::uint32_t runsOf(std::uint32_t segments) { return (segments + kRunSegments - 1) / kRunSegments; }

// Calls use(run) for the fewest runs, of nearly equal length, that make up `count` segments from `begin` on. The i-th
// of p runs begins at segment floor(i count / p).
template <class Use>
void forEachRun(std::uint32_t begin, std::uint32_t count, const Use& use) {
  const std::uint32_t pieces = runsOf(count);
  if (pieces == 0) return;
  // count / pieces and its remainder; the quotient is 1 to 4.
  static_assert(kRunSegments == 4);
  const std::uint32_t least = 4 * pieces == count ? 4 : 3 * pieces <= count ? 3 : 2 * pieces <= count ? 2 : 1;
  const std::uint32_t rest = count - least * pieces;
  std::uint32_t at = begin, sum = 0;
  for (std::uint32_t i = 0; i < pieces; ++i) {
    sum += rest;
    const std::uint32_t more = sum >= pieces ? 1 : 0, length = least + more;
    sum -= more * pieces;
    use(SegmentRun{8 * at + (length - 1)});
    at += length;
  }
}

// The order in which items with these centres form compact groups of 8, 64 and so on, as positions in `centres`. Splits
// at the median along the longest side, at multiples of the group's size. Depends only on the centres. O(n log n).
std::vector<std::uint32_t> orderRuns(std::span<const GridPoint> centres);

}  // namespace filiform::internal
