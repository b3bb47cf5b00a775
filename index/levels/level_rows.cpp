#include "index/levels/level_rows.h"

#include "index/errors.h"

#include <cmath>

namespace filiform {
namespace {

// Appends the tile's owned segments whose boxes meet the box.
void appendRows(std::vector<LevelRow>& rows, const Tile& tile, const TileAppearance& appearance, const LevelBox& box) {
  for (std::uint32_t s = 0, owned = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    const std::uint32_t at = owned++;
    const Vector3d a = tile.position_W(tile.child(s)), b = tile.position_W(tile.parent(s));
    if ((a.cwiseMin(b).array() > box.hi_W.array()).any() || (a.cwiseMax(b).array() < box.lo_W.array()).any()) continue;
    rows.push_back({a, b, appearance.radii_um.at(at), appearance.types.at(at), tile.segmentId(s).cell});
  }
}

}  // namespace

LevelRows levelRows(const TileSet& set, const Levels& levels, const LevelBox& box) {
  if (!(box.pixels > 0) || std::isinf(box.pixels)) throw UsageError("pixels: must be a finite number above 0");
  const double side_um = (box.hi_W - box.lo_W).maxCoeff();
  if (!(side_um > 0)) throw UsageError("box: its corners must differ");
  LevelView view;
  view.orthographic = true;
  view.pixels_per_rad = box.pixels / side_um;
  view.eye_W = 0.5 * (box.lo_W + box.hi_W);
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d n = Vector3d::Zero();
    n[axis] = 1;
    view.planes.push_back({n, box.lo_W[axis]});
    view.planes.push_back({-n, -box.hi_W[axis]});
  }
  const LevelChoice choice = levels.choose(view, box.most_segments);
  LevelRows found{.rows = {},
                  .error_um = choice.error_px * side_um / box.pixels,
                  .hidden = choice.hidden,
                  .limited = choice.limited};
  for (const LevelPart& part : choice.parts) {
    if (part.level)
      appendRows(found.rows, *levels.load(part.tile), levels.loadAppearance(part.tile), box);
    else
      appendRows(found.rows, *set.load(part.tile), set.loadAppearance(part.tile), box);
    if (box.check) box.check();
  }
  return found;
}

}  // namespace filiform
