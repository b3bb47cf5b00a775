// CellPass: reads many cells of a set, in a given order, and decodes each tile once for all of them.
//
//   CellPass cells(*set, ids);
//   for (std::size_t i = 0; i < ids.size(); ++i) use(cells.next());
#pragma once

#include "index/query/cell_graph.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace filiform {

struct CellPassOptions {
  bool with_appearance = true;  // as readCell() has it
  // For the cells that are put together at a time, at least one. If all do not fit, the segments of the later ones wait
  // in memory and then in an unnamed file in the folder of temporary files, in some 14 bytes each. Only in a page,
  // whose files lie in its memory, and with less than kGroupBytes for each group of cells that fit into half of the
  // memory, several passes over the tiles follow each other, each over the next cells that fit.
  std::uint64_t memory_bytes = 256 << 20;
  unsigned threads = 1;           // that decode tiles of a set in a folder, at least 1
  std::function<void()> check{};  // called before each tile; its exceptions propagate from next()
};

// Thread rule: thread-compatible.
class CellPass {
 public:
  static constexpr std::uint64_t kGroupBytes = 16 << 10;

  // Reads nothing. The store must outlive this object. Requires that the cells differ and are below cell_count().
  CellPass(const TileStore& store, std::vector<std::uint32_t> cells, CellPassOptions options = {});
  ~CellPass();

  // The next cell, as readCell() gives it. Requires that not all were taken. Throws as readCell() does, and IoError if
  // the disk is full; no call may follow. Memory: `memory_bytes`, the details of the cells put together, the tiles of
  // TilesAhead, and the cell that is returned. All calls together, in one pass: O(segments of the tiles + samples of
  // the cells).
  CellGraph next();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
