#include "index/set/internal/tile_entry.h"

#include "index/geometry/partition.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {

GridBox clippedBox(const GridPoint& a, const GridPoint& b, const GridBox& block) {
  GridBox box{a.cwiseMin(b).cwiseMax(block.lo), a.cwiseMax(b).cwiseMin(block.hi)};
  if (box.empty() || ((a.array() >= block.lo.array() && a.array() <= block.hi.array()).all() &&
                      (b.array() >= block.lo.array() && b.array() <= block.hi.array()).all()))
    return box;
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
  const GridBox block = closedBlock(tile.key());
  std::uint32_t last = UINT32_MAX;  // the child of the segment before
  GridPoint a = GridPoint::Zero();
  bool a_inside = false;
  const auto inside = [&](const GridPoint& p) {
    return (p.array() >= block.lo.array()).all() && (p.array() <= block.hi.array()).all();
  };
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    const std::uint32_t child = tile.child(s), parent = tile.parent(s);
    entry.isolated += child == parent && tile.owned(s);
    const bool follows = parent == last;
    const GridPoint b = follows ? a : tile.gridPoint(parent);
    const bool b_inside = follows ? a_inside : inside(b);
    a = tile.gridPoint(child);
    a_inside = inside(a);
    last = child;
    if (a_inside && b_inside) {
      entry.content.extend(a);
      if (!follows) entry.content.extend(b);
    } else if (tile.isLong()) {
      entry.content.extend(a);
      entry.content.extend(b);
    } else {
      entry.content.extend(clippedBox(a, b, block));
    }
  }
  return entry;
}

}  // namespace filiform::internal
