#include "viewer/scene/draw_list.h"

#include <algorithm>

namespace filiform {

DrawList chooseTiles(const TileStore& store, const Levels* levels, const LevelView& view, const Vector3d& focus_W,
                     std::uint64_t most_segments, double enough_px, UnreadTiles unread) {
  if (levels != nullptr) return {levels->choose(view, most_segments, enough_px, unread)};
  DrawList list;
  struct DrawableTile {
    double distance2_um2;
    TileId tile;
  };
  std::vector<DrawableTile> candidates;
  for (TileId tile = 0; tile < store.tile_count(); ++tile) {
    const TileEntry& entry = store.entry(tile);
    if (entry.content.empty() || entry.owned == 0) continue;
    const Vector3d lo = store.grid().toWorld(entry.content.lo), hi = store.grid().toWorld(entry.content.hi);
    if (tile == store.long_tile()) {
      candidates.push_back({-1, tile});
      continue;
    }
    const bool seen = std::all_of(view.planes.begin(), view.planes.end(), [&](const LevelView::Plane& plane) {
      const Vector3d innermost = (plane.n.array() >= 0).select(hi, lo);
      return plane.n.dot(innermost) >= plane.d;
    });
    if (!seen) continue;
    candidates.push_back({(lo - focus_W).cwiseMax(focus_W - hi).cwiseMax(0.0).squaredNorm(), tile});
  }
  std::sort(candidates.begin(), candidates.end(), [](const DrawableTile& a, const DrawableTile& b) {
    return a.distance2_um2 != b.distance2_um2 ? a.distance2_um2 < b.distance2_um2 : a.tile < b.tile;
  });
  for (const DrawableTile& candidate : candidates) {
    const std::uint32_t owned = store.entry(candidate.tile).owned;
    if (list.segments + owned > most_segments) {
      list.left_out += owned;
      ++list.tiles_left_out;
      continue;
    }
    list.segments += owned;
    list.parts.push_back({false, candidate.tile, owned, 0});
  }
  return list;
}

}  // namespace filiform
