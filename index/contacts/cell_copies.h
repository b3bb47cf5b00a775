// Copies of cells: one neuron under two names. Contacts between them are none.
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform {

struct CellCopy {
  std::uint32_t cell, of;  // of: the lowest cell with the same samples, below `cell`
};

// The cells among `cells` whose positions and links equal those of a lower one, ascending. Names, ids, radii and types
// may differ. Compares the records of all cells; of cells with equal records reads and compares the samples, by
// SHA-256, as many at a time as fit the memory. Requires that `cells` ascend. `check` is called before each tile; its
// exceptions propagate. Throws what the store throws. Thread rule: any thread but the haptic one. O(cells log cells +
// samples of cells with equal records).
std::vector<CellCopy> findCopies(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                 std::uint64_t memory_bytes = 256 << 20, unsigned threads = 1,
                                 const std::function<void()>& check = {});

}  // namespace filiform
