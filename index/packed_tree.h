// The search structure of a tile ("packed"): a hierarchy of boxes, eight to a node, without pointers, over the tile's
// runs of segments. The runs lie in the tile in the tree's order, so building is one pass over the nodes: no sorting.
// Boxes are 16-bit numbers of a unit that is a power of two quanta, rounded outward; positions stay in the tile.
#pragma once

#include "index/tile_engine.h"

#include <memory>
#include <string>
#include <vector>

namespace filiform {

// How eight boxes are tested at once: "portable" everywhere, "avx2" where the processor has it. All give the same
// answers, bit for bit.
std::vector<std::string> packedTreePaths();  // that this machine runs, the fastest last

// O(segments). Takes 13.7 bytes a run of up to four segments: 4 to 5 bytes a stored segment in dense tissue (README.md,
// A tile in memory), more where runs are short. The engine keeps the tile alive. Throws UsageError for a path that this
// machine does not run; empty: the fastest.
std::unique_ptr<TileEngine> makePackedTree(std::shared_ptr<const Tile> tile, const std::string& path = "");

}  // namespace filiform
