#include "index/set/reads_at_once.h"

namespace filiform {

unsigned readsAtOnce(const TileStore& store) { return store.isRemote() ? 32 : 1; }

unsigned mostReadThreads() { return 64; }

}  // namespace filiform
