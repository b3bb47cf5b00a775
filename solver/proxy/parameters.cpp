#include "solver/proxy/parameters.h"

#include "index/errors.h"
#include "index/set/tiles_ahead.h"

#include <algorithm>

namespace filiform {

namespace {

// The smallest length that is not exceeded by `percent` percent of all lengths.
double percentile(std::vector<double>& lengths_um, std::size_t percent) {
  const std::size_t rank = (lengths_um.size() * percent + 99) / 100;
  const auto at = lengths_um.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(lengths_um.begin(), at, lengths_um.end());
  return *at;
}

}  // namespace

SolverParameters automaticParameters(std::vector<double> lengths_um) {
  SolverParameters parameters;
  std::erase(lengths_um, 0.0);
  if (lengths_um.empty()) return parameters;
  parameters.gain = 1.0;
  parameters.r_min_um = percentile(lengths_um, 5);
  parameters.r_max_um = percentile(lengths_um, 95);
  return parameters;
}

SolverParameters automaticParameters(const Cell& cell, const Grid& grid) {
  std::vector<double> lengths_um;
  lengths_um.reserve(cell.samples());
  for (std::size_t child = 0; child < cell.samples(); ++child) {
    const std::uint32_t parent = cell.parents[child];
    if (parent == kNoParent) continue;
    const GridPoint d = grid.snap(cell.positions_um[child]) - grid.snap(cell.positions_um[parent]);
    lengths_um.push_back(grid.toWorld(d).norm());
  }
  return automaticParameters(std::move(lengths_um));
}

SolverParameters automaticParameters(const TileStore& store, std::uint32_t cell, const std::atomic<bool>* stop) {
  std::vector<double> lengths_um;
  const std::vector<TileId> tiles = store.cellTiles(cell);
  TilesAhead ahead(store, tiles, false);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (stop != nullptr && stop->load(std::memory_order_relaxed)) throw Interrupted("the cell is no longer wanted");
    const std::shared_ptr<const Tile> tile = ahead.next().tile;
    for (std::uint32_t segment = 0; segment < tile->segment_count(); ++segment) {
      if (!tile->owned(segment) || tile->segmentId(segment).cell != cell) continue;
      lengths_um.push_back((tile->position_W(tile->parent(segment)) - tile->position_W(tile->child(segment))).norm());
    }
  }
  return automaticParameters(std::move(lengths_um));
}

}  // namespace filiform
