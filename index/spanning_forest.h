// The forest that a graph is walked along where loops are in the way: routes, and the direction of links.
// Pure function, any thread.
#pragma once

#include "index/cell.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform {

// How a breadth-first search from the lowest rank of each connected component walks `samples` nodes, taking the links
// of a node in the order of `edges`.
struct SpanningForest {
  std::vector<std::uint32_t> parents;  // by rank; kNoParent for the lowest of a component
  std::vector<std::uint32_t> turns;    // when a sample was reached, from 1
};
// Requires ends below `samples`; edges from a sample to itself are passed over. O(samples + edges).
SpanningForest spanningForest(std::size_t samples, const std::vector<std::array<std::uint32_t, 2>>& edges);

}  // namespace filiform
