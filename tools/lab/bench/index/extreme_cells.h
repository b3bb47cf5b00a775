// Extreme cells for benchmarks. Functions without state.
#pragma once

#include "index/cell/cell.h"

#include <cstddef>
#include <cstdint>
#include <string>

namespace filiform::tools {

Cell emptyCell(const std::string& source);

// Adds a sample of 0.5 um radius, type axon. `parent` is a rank or kNoParent. O(1), amortised.
void addSample(Cell& cell, const Vector3d& p_W, std::uint32_t parent);

// One node with this number of branches, each to a random place in the cube of 40 um around the node.
Cell hubCell(std::size_t branches, std::uint64_t seed);

// A spine along x, 1 um a step, with a twig of 3 um at every step.
Cell combCell(std::size_t twigs);

}  // namespace filiform::tools
