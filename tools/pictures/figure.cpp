#include "tools/pictures/figure.h"

#include "index/query/soma_finder.h"
#include "tools/pictures/legend.h"
#include "viewer/scene/cell_palette.h"
#include "viewer/scene/drawn_somata.h"
#include "viewer/scene/minimap.h"
#include "viewer/scene/neurite_batches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace filiform::tools {
namespace {

void drawScaleBar(Canvas& canvas, const PictureSize& size, double px_um, double capital, Rgba ink) {
  const ScaleBar bar = scaleBar(1 / px_um, size.width / 5.0);
  const double right = size.width - 2 * capital, y = size.height - 2 * capital;
  canvas.fill(right - bar.length_px, y, right, y + std::max(2.0, capital / 4), ink);
  const std::string text = bar.text.ends_with(" um") ? bar.text.substr(0, bar.text.size() - 2) + "\u00b5m" : bar.text;
  canvas.text(text, {right - bar.length_px / 2, y - 0.6 * capital}, capital, ink, Align::centre);
}

void drawOrientation(Canvas& canvas, const PictureSize& size, const EyeView& view, double capital, Rgba ink) {
  const Vector2d origin(4 * capital, size.height - 4 * capital);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d way_V = view.rotation_VW.col(axis);
    const Vector2d way(way_V.x(), -way_V.y()), tip = origin + 2.4 * capital * way;
    canvas.line(origin, tip, std::max(1.0, capital / 8), ink);
    if (way.norm() < 0.15) continue;  // along the line of sight: the letter would lie on the others
    const Vector2d at = tip + 0.9 * capital * way.normalized();
    canvas.text(std::string(1, "xyz"[axis]), {at.x(), at.y() + 0.4 * capital}, 0.8 * capital, ink, Align::centre);
  }
}

struct Shape {
  Vector2d a, b;
  double radius_a, radius_b, depth_um;
  Rgba colour;
};

// Adds what lies before the near plane. Lines are a pixel wide at least.
void addShape(std::vector<Shape>& shapes, const NeuriteBatch& batch, const DrawnSegment& segment, Rgba colour,
              const EyeView& view, const PictureSize& size, double px_rad) {
  constexpr double kLeast_px = 0.5;
  const auto endOf = [&](const float* p, double radius_um) {
    const Vector3d p_V = view.toView(batch.origin_W + Vector3d(p[0], p[1], p[2]));
    return Eigen::Vector4d(p_V.x(), p_V.y(), p_V.z(), radius_um);
  };
  Eigen::Vector4d a = endOf(segment.a_um, segment.a_radius_um), b = endOf(segment.b_um, segment.b_radius_um);
  const double near_um = view.frustum.near_um;
  if (-a.z() < near_um && -b.z() < near_um) return;
  const auto cut = [near_um](const Eigen::Vector4d& hidden, const Eigen::Vector4d& seen) {
    const double t = (-near_um - hidden.z()) / (seen.z() - hidden.z());
    return Eigen::Vector4d(hidden + t * (seen - hidden));
  };
  if (-a.z() < near_um) a = cut(a, b);
  if (-b.z() < near_um) b = cut(b, a);
  const auto onScreen = [&](const Eigen::Vector4d& end) {
    const ScreenPoint p = project(view, view.eye_W + view.rotation_VW.transpose() * end.head<3>(), size);
    return Vector3d(p.x, p.y, std::max(kLeast_px, end.w() * px_rad / p.depth_um));
  };
  Vector3d from = onScreen(a), to = onScreen(b);
  // Cut by lines about the picture: Cairo has no far places.
  const double reach = std::max(from.z(), to.z());
  const double sides[] = {static_cast<double>(size.width), static_cast<double>(size.height)};
  double begin = 0, end = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double way = to[axis] - from[axis];
    const double lo = -reach - from[axis], hi = sides[axis] + reach - from[axis];
    if (way == 0 && (lo > 0 || hi < 0)) return;
    if (way == 0) continue;
    begin = std::max(begin, std::min(lo / way, hi / way));
    end = std::min(end, std::max(lo / way, hi / way));
  }
  if (begin > end) return;
  const Vector3d whole = to - from;
  to = from + end * whole;
  from += begin * whole;
  shapes.push_back({from.head<2>(), to.head<2>(), from.z(), to.z(), -0.5 * (a.z() + b.z()), colour});
}

}  // namespace

void drawMarks(Canvas& canvas, const PictureSize& size, const EyeView& view, double focus_um,
               const FigureMarks& marks) {
  const double capital = capitalOf(size);
  const Rgba ink = inkOn(marks.on_light);
  if (marks.legend != nullptr) drawLegend(canvas, size, *marks.legend, marks.on_light);
  if (!marks.title.empty())
    canvas.text(marks.title, {size.width / 2.0, 2.4 * capital}, 1.2 * capital, ink, Align::centre);
  if (marks.scale_bar) drawScaleBar(canvas, size, pixelsPerRadian(view.frustum, size) / focus_um, capital, ink);
  if (marks.orientation) drawOrientation(canvas, size, view, capital, ink);
}

VectorFigures drawVectors(Canvas& canvas, const PictureSize& size, const EyeView& view, const TileStore& store,
                          const VectorScene& scene) {
  VectorFigures figures;
  std::vector<Shape> shapes;
  RootTable roots;
  SomaFinder finder(store);
  const double px_rad = pixelsPerRadian(view.frustum, size);
  CellPalette palette = makePalette(store.cell_count(), scene.colour, scene.cell_colours.get(), nullptr);
  palette.shallow_um = scene.shallow_um;
  palette.deep_um = scene.deep_um;
  BatchOptions options;
  for (TileId id = 0; id < store.tile_count(); ++id) {
    if (scene.check) scene.check(id);
    const std::shared_ptr<const Tile> tile = store.load(id);
    const TileAppearance appearance = store.loadAppearance(id);
    for (const std::uint32_t cell : cellsWithOpenNodes(*tile)) addRoots(store, cell, roots);
    const SomaTable somata = somataIn(*tile, appearance, roots, finder);
    options.roots = &roots;
    options.somata = &somata;
    const NeuriteBatch batch = makeBatch(*tile, appearance, options);
    figures.implausible_radii += batch.implausible_radii;
    for (const DrawnSegment& segment : batch.segments)
      addShape(shapes, batch, segment, paintedColour(segment, batch, palette), view, size, px_rad);
  }
  std::stable_sort(shapes.begin(), shapes.end(),
                   [](const Shape& a, const Shape& b) { return a.depth_um > b.depth_um; });
  for (const Shape& s : shapes) {
    if (s.a == s.b)
      canvas.disc(s.a, s.radius_a, s.colour);
    else
      canvas.taper(s.a, s.radius_a, s.b, s.radius_b, s.colour);
  }
  figures.segments = shapes.size();
  return figures;
}

}  // namespace filiform::tools
