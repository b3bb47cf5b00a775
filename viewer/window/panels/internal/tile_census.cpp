#include "viewer/window/panels/internal/tile_census.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace filiform::internal {

std::vector<NearTile> TileCensus::nearest(const Vector3d& p_W, std::size_t most) const {
  const Grid grid = store_.grid();
  std::vector<NearTile> tiles;
  TileFinder::Walk walk = finder_.walk(p_W);
  while (tiles.size() < most) {
    const std::optional<TileFinder::Hit> hit = walk.next();
    if (!hit) break;
    const GridBox& box = store_.entry(hit->tile).content;
    tiles.push_back({hit->tile, grid.toWorld(box.lo), grid.toWorld(box.hi)});
  }
  return tiles;
}

TilePanel countTiles(const TileStore& store, const Residency* residency, const TilePanel& before, double since_s) {
  TilePanel panel;
  panel.tiles = store.tile_count();
  panel.in_memory = residency == nullptr;
  if (residency == nullptr) return panel;
  panel.counters = residency->counters();
  panel.budget_bytes = residency->budget_bytes();
  panel.failures = residency->missing();
  panel.reads_s = static_cast<double>(panel.counters.reads - before.counters.reads) / since_s;
  panel.read_bytes_s =
      static_cast<double>(panel.counters.bytes_read_decoded - before.counters.bytes_read_decoded) / since_s;
  return panel;
}

void showTiles(const std::vector<NearTile>& near, const Residency* residency, TilePanel& panel) {
  std::vector<std::pair<TileId, TileState>> states;
  if (residency != nullptr) {
    states = residency->states();
    panel.counts[static_cast<int>(TileState::absent)] = panel.tiles - states.size();
    for (const auto& [tile, state] : states) ++panel.counts[static_cast<int>(state)];
  }
  for (const NearTile& near_tile : near) {
    TileState state = residency != nullptr ? TileState::absent : TileState::resident;
    const auto found = std::lower_bound(states.begin(), states.end(), std::pair{near_tile.tile, TileState{}});
    if (found != states.end() && found->first == near_tile.tile) state = found->second;
    panel.boxes.push_back({near_tile.lo_W.x(), near_tile.lo_W.y(), near_tile.hi_W.x(), near_tile.hi_W.y(), state});
  }
  // Absent tiles first, so that the others are drawn over them.
  std::stable_sort(panel.boxes.begin(), panel.boxes.end(), [](const TilePanel::Box& a, const TilePanel::Box& b) {
    return (a.state != TileState::absent) < (b.state != TileState::absent);
  });
}

}  // namespace filiform::internal
