// CellLeaves: lists, for each cell, the leaves that own one of its segments. Workers add pairs of cell and leaf in any
// order. Afterwards the lists are read cell by cell.
#pragma once

#include "index/file/internal/spool.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: add() may run on several threads if each has its own `worker`; everything else is thread-compatible.
// Throws IoError if the spool cannot be written or read.
class CellLeaves {
 public:
  // `folder`: for the spool's file; empty: all in memory. Pairs stay in memory up to `spool_memory` bytes. One group of
  // cells at a time is sorted, in about `sort_memory` bytes. O(pairs) if each worker adds ascending leaves.
  CellLeaves(const std::vector<CellRecord>& records, unsigned workers, std::string folder, std::uint64_t spool_memory,
             std::uint64_t sort_memory);

  void add(unsigned worker, std::uint32_t cell, std::uint32_t leaf) {
    const Pair pair{cell, leaf};
    chains_[worker * group_begin_.size() + groupOf(cell)].append(
        {reinterpret_cast<const std::uint8_t*>(&pair), sizeof pair});
  }
  void close();  // call it once, after the last add()

  // True if next(cell) reads and sorts a group.
  bool startsGroup(std::uint32_t cell) const {
    return next_group_ < group_begin_.size() && group_begin_[next_group_] == cell;
  }
  // The leaves of a cell, ascending. Call it for each cell, in order of ids. Valid until the next call.
  std::span<const std::uint32_t> next(std::uint32_t cell);

 private:
  struct Pair {
    std::uint32_t cell, leaf;
  };
  std::size_t groupOf(std::uint32_t cell) const;
  void readGroup(std::size_t group);

  unsigned workers_;
  std::uint32_t cells_;
  Spool spool_;                             // small blocks: many are open at a time
  std::vector<std::uint32_t> group_begin_;  // of cells
  std::vector<ByteChain> chains_;           // by worker, then by group
  std::size_t next_group_ = 0;
  // Of the current group:
  std::vector<Pair> pairs_;            // as they came
  std::vector<std::uint32_t> leaves_;  // by cell
  std::vector<std::uint32_t> end_;     // of each cell, among the leaves
  std::uint32_t first_cell_ = 0;
};

}  // namespace filiform::internal
