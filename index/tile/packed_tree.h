// The search structure of a tile ("packed"): a hierarchy of boxes without pointers, eight boxes a node, over the tile's
// runs of segments. The tile stores its runs in the tree's order, so the tree is built in one pass, without sorting.
// Boxes are 16-bit numbers, rounded outward; their unit is a power of two quanta. Positions stay in the tile.
#pragma once

#include "index/tile/tile_engine.h"

#include <memory>
#include <string>
#include <vector>

namespace filiform {

// Names of the instruction sets for which the tree is compiled and that this machine runs, the fastest last: of
// "emulated" (every processor), "ssse3", "sse4", "avx2", "avx512", "neon". A path tests eight boxes at once; all paths
// give the same bits.
std::vector<std::string> packedTreePaths();

// Builds the structure. O(segments). Takes 13.7 bytes a run of up to four segments: 4 to 5 bytes a stored segment in
// dense tissue, more if runs are short. The engine keeps the tile alive. An empty `path` means the fastest. Throws
// UsageError for a path that this machine cannot run.
std::unique_ptr<TileEngine> makePackedTree(std::shared_ptr<const Tile> tile, const std::string& path = "",
                                           SomeRuns some = {});

}  // namespace filiform
