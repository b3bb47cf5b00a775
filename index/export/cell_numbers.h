// CellNumbers: the number of each cell, for formats that name objects by 64-bit numbers.
//
// If all names of a set's cells are whole numbers from 1 to 2^64 - 1, without leading zeros, a cell's number is its
// name. Otherwise it is its id + 1, because Neuroglancer takes 0 for "no object".
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <optional>

namespace filiform {

// Thread rule: immutable.
class CellNumbers {
 public:
  // The store must outlive this object. Reads the table of cells up to the first name that is no number. Calls `check`
  // once for each 256 cells; it may throw to stop. Throws what the store throws. O(cells).
  explicit CellNumbers(const TileStore& store, const std::function<void()>& check = {});

  // The number of a cell. Requires cell < cell_count() and that it is not removed. Throws what the store throws.
  std::uint64_t of(std::uint32_t cell) const;
  // The cell with a number; nullopt: none, or it is removed. Throws what the store throws. O(log cells).
  std::optional<std::uint32_t> find(std::uint64_t number) const;

 private:
  const TileStore& store_;
  bool names_ = true;
};

}  // namespace filiform
