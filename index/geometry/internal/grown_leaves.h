// The leaves of a set to which another set is added.
#pragma once

#include "index/geometry/morton.h"

#include <span>
#include <vector>

namespace filiform::internal {

// Covers the world with disjoint blocks, ascending: all leaves of `base`; the leaves of `added` that lie in the empty
// space between them; and the largest blocks that fill the rest. Requires two lists of disjoint blocks, each ascending.
// O(leaves * depth).
std::vector<BlockKey> grownLeaves(std::span<const BlockKey> base, std::span<const BlockKey> added = {});

}  // namespace filiform::internal
