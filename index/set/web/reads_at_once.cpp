// A browser makes six requests to a host at once, and a tile takes two. More threads would only wait. Stands in for
// reads_at_once.cpp in the preset `web`.
#include "index/set/reads_at_once.h"

namespace filiform {

unsigned readsAtOnce(const TileStore& store) { return store.isRemote() ? 3 : 1; }

unsigned mostReadThreads() { return 6; }

}  // namespace filiform
