// How many reads of a set may be under way at once with profit; each waits on a thread of its own. Thread rule: pure
// function.
#pragma once

#include "index/set/tile_store.h"

namespace filiform {

// 1 for a set in memory or in a folder.
unsigned readsAtOnce(const TileStore& store);

// Threads for the reads of a set at an address that one purpose begins ahead: each tile in two parts.
unsigned mostReadThreads();

}  // namespace filiform
