#include "index/set/internal/tile_entry.h"

#include "index/geometry/partition.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {
GridBox clippedBox(const GridPoint& a, const GridPoint& b, const GridBox& block) {
  GridBox box{a.cwiseMin(b).cwiseMax(block.lo), a.cwiseMax(b).cwiseMin(block.hi)};
  if (box.empty() || (block.contains(a) && block.contains(b))) return box;
  // Coordinates are below 2^42, so errors of doubles are below 2^-8 quanta. Rounding outward by one quantum is safe.
  double from = 0, to = 1;
  const Vector3d start = a.cast<double>(), d = (b - a).cast<double>();
  for (int i = 0; i < 3; ++i) {
    if (d[i] == 0) continue;
    const double t0 = (static_cast<double>(block.lo[i]) - start[i]) / d[i];
    const double t1 = (static_cast<double>(block.hi[i]) - start[i]) / d[i];
    from = std::max(from, std::min(t0, t1));
    to = std::min(to, std::max(t0, t1));
  }
  const Vector3d p = start + from * d, q = start + to * d;
  for (int i = 0; i < 3; ++i) {
    box.lo[i] = std::max(box.lo[i], static_cast<std::int64_t>(std::floor(std::min(p[i], q[i]))) - 1);
    box.hi[i] = std::min(box.hi[i], static_cast<std::int64_t>(std::ceil(std::max(p[i], q[i]))) + 1);
  }
  return box;
}

TileEntry entryOf(const Tile& tile) {
  TileEntry entry;
  entry.key = tile.key();
  entry.owned = tile.owned_count();
  entry.stored = tile.segment_count();
  entry.decoded_bytes = tile.bytes();
  const bool is_long = tile.isLong();
  const GridBox block = is_long ? BlockKey{}.box() : closedBlock(tile.key());
  std::vector<std::uint8_t> outside(tile.node_count(), 0);
  bool all_inside = true;
  tile.forEachNode([&](std::uint32_t node, const GridPoint& p) {
    if (block.contains(p)) {
      entry.content.extend(p);
    } else {
      outside[node] = 1;
      all_inside = false;
    }
  });
  tile.forEachSegment([&](std::uint32_t s, std::uint32_t child, std::uint32_t parent) {
    if (child == parent) entry.isolated += tile.owned(s);
    if (all_inside || (outside[child] | outside[parent]) == 0) return;
    const GridPoint a = tile.gridPoint(child), b = tile.gridPoint(parent);
    const GridBox around{a.cwiseMin(b).cwiseMax(block.lo), a.cwiseMax(b).cwiseMin(block.hi)};  // of the clipped box
    if (!entry.content.contains(around.lo) || !entry.content.contains(around.hi))
      entry.content.extend(clippedBox(a, b, block));
  });
  return entry;
}

}  // namespace filiform::internal
