// readCell() of cell_graph.h.
#include "index/errors.h"
#include "index/query/cell_graph.h"
#include "index/query/internal/cell_assembly.h"
#include "index/query/internal/owned_segments.h"
#include "index/set/tiles_ahead.h"

namespace filiform {

CellGraph readCell(const TileStore& store, std::uint32_t cell, bool with_appearance, const std::atomic<bool>* stop) {
  internal::CellAssembly assembly(store, cell, store.loadCellDetail(cell), with_appearance);
  std::vector<PassedSegment> segments;
  const auto take = [&](const std::vector<TileId>& tiles) {
    TilesAhead ahead(store, tiles, with_appearance);
    for (const TileId id : tiles) {
      if (stop != nullptr && stop->load(std::memory_order_relaxed)) throw Interrupted("the cell is no longer wanted");
      const auto [tile, appearance] = ahead.next();
      segments.clear();
      internal::appendOwned(*tile, with_appearance ? &appearance : nullptr, cell, segments);
      assembly.add(id, segments);
    }
  };
  take(assembly.tiles());
  take(assembly.endTiles());
  return assembly.finish();
}

}  // namespace filiform
