// A few points that stand for the whole data set: a search tree over them bounds any nearest-segment search without
// touching the disk, and alone answers it with a stated error.
#pragma once

#include "index/tile_store.h"

#include <span>

namespace filiform {

inline constexpr std::size_t kMaxSamplePoints = 65536;

struct SegmentEnds {
  SegmentId id;
  GridPoint child, parent;
};

// At most `most` points of the segments, and at most four a segment, and the radius within which they cover every point
// of every segment. A pure function of the segments, which must be in ascending order of id. Points are nodes, or
// points inside a long segment rounded to the grid: such a point (0 < t < 1) lies within one quantum of its segment.
// O(n log most).
SamplePoints chooseSamples(std::span<const SegmentEnds> segments, const Grid& grid,
                           std::size_t most = kMaxSamplePoints);

// The same from the owned segments of all tiles of a store; reads every tile.
SamplePoints chooseSamples(const TileStore& store, std::size_t most = kMaxSamplePoints);

}  // namespace filiform
