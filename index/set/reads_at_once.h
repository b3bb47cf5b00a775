// How many reads of a set may be under way at once with profit; each waits on a thread of its own. Thread rule: any
// thread.
#pragma once

#include "index/file/read_threads.h"
#include "index/set/tile_store.h"

namespace filiform {

// 1 for a set in memory or in a folder.
unsigned readsAtOnce(const TileStore& store);

// Threads for the reads of a set at an address that one purpose begins ahead: each tile in two parts.
unsigned mostReadThreads();
// As many threads, for all reads of the program that are begun ahead. They start when they are first needed.
inline ReadThreads& readThreads() {
  static ReadThreads threads(mostReadThreads());
  return threads;
}

}  // namespace filiform
