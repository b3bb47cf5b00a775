// Sorts many Morton keys.
#pragma once

#include "index/geometry/morton.h"

#include <vector>

namespace filiform::internal {

// Sorts ascending. O(n) if the keys differ in few bits, as in a small part of the world. Takes 16 more bytes a key.
void sortKeys(std::vector<MortonKey>& keys);

}  // namespace filiform::internal
