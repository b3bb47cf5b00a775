#include "solver/travel/routes/tour.h"

#include "index/errors.h"
#include "index/query/cell_graph.h"
#include "solver/travel/routes/internal/draw.h"

#include <algorithm>

namespace filiform {
namespace {

constexpr int kMostPassedOver = 1000;  // cells in a row whose segments have no length

}  // namespace

Tour::Tour(const TileStore& store, std::uint64_t seed, std::optional<std::uint32_t> only)
    : store_(store), random_(seed), only_(only) {}

Route Tour::next(const std::atomic<bool>* stop) {
  const std::uint64_t cells = store_.cell_count();
  for (int passed_over = 0; passed_over < kMostPassedOver; ++passed_over) {
    if (cells == 0) break;
    std::uint32_t cell = only_.value_or(0);
    if (!only_) {
      // Cells without segments are common in some sets. Skipping them reads nothing.
      std::uint64_t draws = 0;
      do {
        cell = static_cast<std::uint32_t>(internal::drawBelow(random_, cells));
      } while (store_.cell(cell).segments == 0 && ++draws < 64 * cells);
    }
    const std::uint64_t seed = random_();
    if (store_.cell(cell).segments == 0) break;
    const CellGraph graph = readCell(store_, cell, false, stop);
    if (const std::optional<Route> route = planRandomRoute(graph, cell, seed)) return *route;
    if (only_) break;
  }
  throw UsageError(only_ ? "the cell has no route: none of its segments has a length (a soma has none)"
                         : "the set has no route to tour: no cell with a segment that has a length was found");
}

}  // namespace filiform
