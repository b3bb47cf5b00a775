// Finds the somata of a tile that are drawn as spheres, and the radius and type of roots. Pure functions, except that
// they use the given finder. Thread rule: the finder's thread.
#pragma once

#include "index/query/soma_finder.h"
#include "index/set/tile_store.h"

#include <map>
#include <memory>

namespace filiform {

// Radius and type of roots, which belong to no segment's child end. Most somata are roots.
using RootTable = std::map<NodeId, CellDetail::Root>;
// Adds the roots of a cell to the table. Throws CorruptSet, IoError from the store. O(samples of the cell).
void addRoots(const TileStore& store, std::uint32_t cell, RootTable& roots);

// Somata that are drawn as spheres, under the id of each of their samples, the root included.
using SomaTable = std::map<NodeId, std::shared_ptr<const Soma>>;

// The somata in which owned segments of a full-resolution tile begin or lie. `roots` must hold the roots of all
// cellsWithOpenNodes(). A soma that cannot be read is missing from the table: its samples are then drawn instead. O(n),
// plus reads of the somata's other tiles.
SomaTable somataIn(const Tile& tile, const TileAppearance& appearance, const RootTable& roots, SomaFinder& finder);

}  // namespace filiform
