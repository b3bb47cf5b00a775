// thinned(): the neurites of one tile, simplified in one pass over its segments.
#pragma once

#include "index/levels/internal/neurites.h"

#include <span>

namespace filiform {

// The owned segments as neuritesOf() makes them, simplified. Adds at most `tolerance_um` to error_um. Keeps the first
// and last sample of each run of consecutive samples, so that join() can link the runs of neighbouring tiles. Requires
// segments in the order of their ids. Thread rule: a function without state. O(n).
Neurites thinned(std::span<const StoredSegment> segments, const TileAppearance& appearance, const Grid& grid,
                 double tolerance_um);

}  // namespace filiform
