// Threads of a page are dear, and a browser makes six requests to a host at once. Stands in for reads_at_once.cpp in
// the preset `web`.
#include "index/set/reads_at_once.h"

namespace filiform {

unsigned readsAtOnce(const TileStore& store) { return store.isRemote() ? 6 : 1; }

}  // namespace filiform
