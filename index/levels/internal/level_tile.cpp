#include "index/levels/internal/level_tile.h"

#include "index/tile/tile_codec.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace filiform::internal {
namespace {

constexpr int kRadiusBits = 4;  // of the mantissa: an error of at most 3 %

float coarseRadius(float radius_um) {
  if (!std::isfinite(radius_um) || radius_um == 0) return radius_um;
  int exponent = 0;
  const float fraction = std::frexp(radius_um, &exponent);
  return std::ldexp(std::round(std::ldexp(fraction, kRadiusBits + 1)), exponent - kRadiusBits - 1);
}

// The grid of a tile: its quantum is at most 1 / 16 of the tolerance.
Grid coarseGrid(const Grid& grid, double tolerance_um) {
  constexpr double kPartsOfTolerance = 16;
  int exponent = grid.exponent();
  while (exponent < Grid::kMaxExponent && std::ldexp(kPartsOfTolerance, exponent + 1) <= tolerance_um) ++exponent;
  return Grid(exponent);
}

}  // namespace

LevelTile encodeLevel(const Neurites& neurites, const BlockKey& key, std::uint32_t coarser, const Grid& fine) {
  LevelTile made;
  TileAppearance appearance;
  const Grid grid = coarseGrid(fine, std::max(neurites.error_um, neurites.pixel_um));
  const int shift = grid.exponent() - fine.exponent();
  const auto rounded = [&](const GridPoint& p) {
    GridPoint out;
    for (int axis = 0; axis < 3; ++axis) out[axis] = (p[axis] + (std::int64_t{1} << shift >> 1)) >> shift;
    return out;
  };
  std::vector<StoredSegment> segments = numbered(neurites, appearance);
  for (float& radius : appearance.radii_um) radius = coarseRadius(radius);
  for (StoredSegment& s : segments) {
    s.child = rounded(s.child);
    s.parent = rounded(s.parent);
    for (const GridPoint& p : {s.child, s.parent}) made.entry.content.extend(GridPoint(p * (std::int64_t{1} << shift)));
  }
  made.entry.key = key;
  made.entry.exponent = grid.exponent();
  made.entry.coarser = coarser;
  made.entry.segments = static_cast<std::uint32_t>(segments.size());
  constexpr double kHalfDiagonal = 0.8661;
  made.entry.error_um = neurites.error_um + (shift > 0 ? kHalfDiagonal * grid.quantum_um() : 0);
  made.entry.represented = neurites.represented;
  made.entry.hidden = neurites.hidden;
  made.entry.pixel_um = neurites.pixel_um;
  made.entry.hidden_um = neurites.hidden_um;
  const Tile tile(0, key, true, grid, segments);
  made.entry.decoded_bytes = tile.bytes();
  made.geometry = encodeTile(tile);
  made.appearance = encodeAppearance(appearance);
  return made;
}

}  // namespace filiform::internal
