#include "viewer/internal/tile_census.h"

#include <algorithm>

namespace filiform::internal {

namespace {

constexpr std::size_t kTilesShown = 3000;

}  // namespace

TilePanel countTiles(const TileStore& store, const Residency* residency, const TilePanel& before, double since_s) {
  TilePanel panel;
  panel.tiles = store.tile_count();
  panel.in_memory = residency == nullptr;
  if (residency == nullptr) return panel;
  panel.counters = residency->counters();
  panel.budget_bytes = residency->budget_bytes();
  panel.failures = residency->failures();
  panel.reads_s = static_cast<double>(panel.counters.reads - before.counters.reads) / since_s;
  panel.read_bytes_s =
      static_cast<double>(panel.counters.bytes_read_decoded - before.counters.bytes_read_decoded) / since_s;
  return panel;
}

void listTiles(const TileStore& store, const Residency* residency, const Vector3d& p_W, TilePanel& panel) {
  const Grid grid = store.grid();
  std::vector<std::pair<double, TileId>> nearest;
  for (TileId tile = 0; tile < store.tile_count(); ++tile) {
    const GridBox& box = store.entry(tile).content;
    if (residency != nullptr) ++panel.counts[static_cast<int>(residency->state(tile))];
    if (box.empty() || tile == store.long_tile()) continue;
    const Vector3d lo = grid.toWorld(box.lo), hi = grid.toWorld(box.hi);
    nearest.emplace_back((lo - p_W).cwiseMax(p_W - hi).cwiseMax(0.0).squaredNorm(), tile);
  }
  const std::size_t kept = std::min(kTilesShown, nearest.size());
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(kept), nearest.end());
  for (std::size_t i = 0; i < kept; ++i) {
    const TileId tile = nearest[i].second;
    const GridBox& box = store.entry(tile).content;
    const Vector3d lo = grid.toWorld(box.lo), hi = grid.toWorld(box.hi);
    panel.boxes.push_back(
        {lo.x(), lo.y(), hi.x(), hi.y(), residency != nullptr ? residency->state(tile) : TileState::resident});
  }
  // Those that are there are drawn over those that are not.
  std::stable_sort(panel.boxes.begin(), panel.boxes.end(), [](const TilePanel::Box& a, const TilePanel::Box& b) {
    return (a.state != TileState::absent) < (b.state != TileState::absent);
  });
}

}  // namespace filiform::internal
