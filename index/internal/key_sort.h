// Many Morton keys in order.
#pragma once

#include "index/morton.h"

#include <vector>

namespace filiform::internal {

// Ascending. O(n) where the keys differ in few of their bits, as those of a small part of the world do. Takes 16 bytes
// a key more.
void sortKeys(std::vector<MortonKey>& keys);

}  // namespace filiform::internal
