// The reference engine ("cgal"): a CGAL AABB tree over the boxes of a tile's segments. It is slower and larger than the
// packed tree, but independent of it. `verify`, the tests and the comparison tables check against it.
#pragma once

#include "index/tile/tile_engine.h"

#include <memory>

namespace filiform {

// Builds the engine over a tile, which the engine keeps alive, or over some of its segments. O(n log n), about 150
// bytes a segment.
std::unique_ptr<TileEngine> makeReferenceTree(std::shared_ptr<const Tile> tile, SomeRuns some = {});

}  // namespace filiform
