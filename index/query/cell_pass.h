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
  // For the cells that are put together at a time. If all do not fit, several passes follow each other, each over as
  // many of the next cells as fit, at least one. A pass reads the tiles that own segments of its cells.
  std::uint64_t memory_bytes = 256 << 20;
  unsigned threads = 1;           // that decode tiles of a set in a folder, at least 1
  std::function<void()> check{};  // called before each tile; its exceptions propagate from next()
};

// Thread rule: thread-compatible.
class CellPass {
 public:
  // Reads nothing. The store must outlive this object. Requires that the cells differ and are below cell_count().
  CellPass(const TileStore& store, std::vector<std::uint32_t> cells, CellPassOptions options = {});
  ~CellPass();

  // The next cell, as readCell() gives it. Requires that not all were taken. Throws as readCell() does; no call may
  // follow. Memory: `memory_bytes`, the details of its cells, the tiles of TilesAhead, and the cell that is returned.
  // All calls together, if one pass suffices: O(segments of the tiles + samples of the cells).
  CellGraph next();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
