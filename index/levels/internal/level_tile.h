// The tile of a level of detail: neurites of a block, encoded.
#pragma once

#include "index/levels/internal/neurites.h"
#include "index/levels/levels.h"

#include <cstdint>
#include <vector>

namespace filiform::internal {

struct LevelTile {
  LevelEntry entry;
  std::vector<std::uint8_t> geometry, appearance;

  std::uint64_t bytes() const { return sizeof *this + geometry.capacity() + appearance.capacity(); }
};

// Encodes the neurites of block `key` on a grid whose quantum is at most 1/16 of their error. Radii are rounded to 5
// significant bits. Thread rule: a function without state. O(n log n).
LevelTile encodeLevel(const Neurites& neurites, const BlockKey& key, std::uint32_t coarser, const Grid& grid);

}  // namespace filiform::internal
