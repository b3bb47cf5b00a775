// Builds the tiles of a small scene in memory, without files, threads or search trees.
#pragma once

#include "index/geometry/partition.h"
#include "index/set/tile_store.h"

#include <memory>

namespace filiform {

// Reads the stream to its end and cuts it into the same tiles that ingest writes. Cell ids are positions in the stream.
// An empty stream gives a store without tiles. load() of the store never fails and costs a reference count. Throws
// UsageError if the capacity is 0 or a cell's arrays disagree in length, and what the stream throws. O(n log n); holds
// everything in memory, about 150 bytes a segment.
std::unique_ptr<TileStore> buildTilesInMemory(CellStream& stream, const PartitionOptions& options = {});

}  // namespace filiform
