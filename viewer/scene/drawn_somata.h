// Somata as they are drawn: radius and type of roots, and the somata of a tile whose samples mean a sphere. Pure
// functions but for the finder they are given; its thread.
#pragma once

#include "index/set/soma_finder.h"
#include "index/set/tile_store.h"

#include <map>
#include <memory>

namespace filiform {

// Radius and type of samples that no segment carries: roots, and with them most somata.
using RootTable = std::map<NodeId, CellDetail::Root>;
// Adds the roots of a cell. Throws CorruptSet, IoError from the store. O(samples of the cell).
void addRoots(const TileStore& store, std::uint32_t cell, RootTable& roots);

// Somata that are drawn as spheres, by their samples: the root and all others.
using SomaTable = std::map<NodeId, std::shared_ptr<const Soma>>;

// Those that the tile's own segments begin or lie in. `roots` must hold the roots of cellsWithOpenNodes(). A soma that
// cannot be read is left out, and then drawn as its samples are. O(n), and reads of the somata's other tiles.
SomaTable somataIn(const Tile& tile, const TileAppearance& appearance, const RootTable& roots, SomaFinder& finder);

// Those of a tile of a level of detail, by the tile's own node ids, which are no samples. Three-point somata are seen
// by their shape: two soma segments at one node, or one of them where the tile has no more. Contours are looked up by
// the place of their nodes; one that cannot be read is left out. O(n), and reads of the contours' full-resolution
// tiles.
SomaTable somataInLevel(const Tile& tile, const TileAppearance& appearance, SomaFinder& finder);

}  // namespace filiform
