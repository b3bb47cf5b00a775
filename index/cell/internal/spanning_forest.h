// The spanning forest of a graph: gives links their direction, and routes a tree to follow. Thread rule: pure function,
// any thread.
#pragma once

#include "index/cell/cell.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform {

// The result of a breadth-first search from the lowest rank of each connected component.
struct SpanningForest {
  std::vector<std::uint32_t> parents;  // by rank; kNoParent for the lowest rank of a component
  std::vector<std::uint32_t> turns;    // by rank: the step at which the search reached the sample, from 1
};
// Searches a graph of `samples` nodes; takes the links of a node in the order of `edges`. Ignores edges from a sample
// to itself. Requires ends below `samples`. O(samples + edges).
SpanningForest spanningForest(std::size_t samples, const std::vector<std::array<std::uint32_t, 2>>& edges);

}  // namespace filiform
