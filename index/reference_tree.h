// The reference engine ("cgal"): a CGAL AABB tree over the boxes of a tile's
// segments. Slower and larger than the packed tree, and by another hand:
// `verify`, the tests and the trade-off tables compare against it.
#pragma once

#include "index/tile_engine.h"

#include <memory>

namespace filiform {

// O(n log n), about 150 bytes a segment. The engine keeps the tile alive.
std::unique_ptr<TileEngine> makeReferenceTree(std::shared_ptr<const Tile> tile);

}  // namespace filiform
