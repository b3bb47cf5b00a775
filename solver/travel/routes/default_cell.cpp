#include "solver/travel/routes/default_cell.h"

#include "index/errors.h"

namespace filiform {

std::uint32_t defaultCell(const TileStore& store) {
  if (store.cell_count() == 0) throw UsageError("the set holds no cell: there is nothing to navigate");
  std::uint32_t best = 0;
  for (std::uint32_t id = 1; id < store.cell_count(); ++id) {
    const CellRecord &cell = store.cell(id), &other = store.cell(best);
    if (cell.segments > other.segments || (cell.segments == other.segments && cell.name < other.name)) best = id;
  }
  return best;
}

}  // namespace filiform
