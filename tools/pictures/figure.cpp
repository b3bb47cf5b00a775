#include "tools/pictures/figure.h"

#include "index/query/soma_finder.h"
#include "tools/pictures/legend.h"
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

struct Inks {
  Rgba letters, halo;
};
Inks inksOn(bool light) { return light ? Inks{kInk, kWhite} : Inks{{235, 238, 245}, kDarkGround}; }

void drawScaleBar(Canvas& canvas, const PictureSize& size, double px_um, double capital, const Inks& inks) {
  const ScaleBar bar = scaleBar(1 / px_um, size.width / 5.0);
  const double right = size.width - 2 * capital, y = size.height - 2 * capital;
  canvas.fill(right - bar.length_px, y, right, y + std::max(2.0, capital / 4), inks.letters);
  canvas.text(bar.text, {right - bar.length_px / 2, y - 0.6 * capital}, capital, inks.letters, Align::centre);
}

void drawOrientation(Canvas& canvas, const PictureSize& size, const EyeView& view, double capital, const Inks& inks) {
  const Vector2d origin(4 * capital, size.height - 4 * capital);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d way_V = view.rotation_VW.col(axis);
    const Vector2d way(way_V.x(), -way_V.y()), tip = origin + 2.4 * capital * way;
    canvas.line(origin, tip, std::max(1.0, capital / 8), inks.letters);
    if (way.norm() < 0.15) continue;  // along the line of sight: the letter would lie on the others
    const Vector2d at = tip + 0.9 * capital * way.normalized();
    canvas.text(std::string(1, "xyz"[axis]), {at.x(), at.y() + 0.4 * capital}, 0.8 * capital, inks.letters,
                Align::centre);
  }
}

struct Shape {
  Vector2d a, b;
  double radius_a, radius_b, depth_um;
  Rgba colour;
};

// Adds what lies before the near plane. Lines are a pixel wide at least.
void addShape(std::vector<Shape>& shapes, const NeuriteBatch& batch, const DrawnSegment& segment, const EyeView& view,
              const PictureSize& size, double px_rad) {
  constexpr double kLeast_px = 0.5;
  const auto placeOf = [&](const float* p) { return view.toView(batch.origin_W + Vector3d(p[0], p[1], p[2])); };
  Vector3d a_V = placeOf(segment.a_um), b_V = placeOf(segment.b_um);
  const double near_um = view.frustum.near_um;
  if (-a_V.z() < near_um && -b_V.z() < near_um) return;
  const auto cut = [near_um](const Vector3d& hidden, const Vector3d& seen) {
    const double t = (-near_um - hidden.z()) / (seen.z() - hidden.z());
    return Vector3d(hidden + t * (seen - hidden));
  };
  if (-a_V.z() < near_um) a_V = cut(a_V, b_V);
  if (-b_V.z() < near_um) b_V = cut(b_V, a_V);
  const auto onScreen = [&](const Vector3d& p_V) {
    const ScreenPoint p = project(view, view.eye_W + view.rotation_VW.transpose() * p_V, size);
    return Vector2d(p.x, p.y);
  };
  Shape shape{onScreen(a_V),
              onScreen(b_V),
              std::max(kLeast_px, segment.a_radius_um * px_rad / -a_V.z()),
              std::max(kLeast_px, segment.b_radius_um * px_rad / -b_V.z()),
              -0.5 * (a_V.z() + b_V.z()),
              segment.colour};
  shape.colour.a = 255;
  const double reach = std::max(shape.radius_a, shape.radius_b);
  const auto outside = [reach](double a, double b, double most) {
    return std::max(a, b) + reach < 0 || std::min(a, b) - reach > most;
  };
  if (!outside(shape.a.x(), shape.b.x(), size.width) && !outside(shape.a.y(), shape.b.y(), size.height))
    shapes.push_back(shape);
}

}  // namespace

void drawMarks(Canvas& canvas, const PictureSize& size, const EyeView& view, double focus_um,
               const FigureMarks& marks) {
  const double capital = std::clamp(size.height / 60.0, 7.0, 60.0);
  const Inks inks = inksOn(marks.on_light);
  if (marks.legend != nullptr) drawLegend(canvas, size, *marks.legend, marks.on_light);
  if (!marks.title.empty())
    canvas.text(marks.title, {size.width / 2.0, 2.4 * capital}, 1.2 * capital, inks.letters, Align::centre);
  if (marks.scale_bar) drawScaleBar(canvas, size, pixelsPerRadian(view.frustum, size) / focus_um, capital, inks);
  if (marks.orientation) drawOrientation(canvas, size, view, capital, inks);
}

void drawVectors(Canvas& canvas, const PictureSize& size, const EyeView& view, const TileStore& store,
                 const VectorScene& scene) {
  std::vector<Shape> shapes;
  RootTable roots;
  SomaFinder finder(store);
  const double px_rad = pixelsPerRadian(view.frustum, size);
  BatchOptions options{.colour = scene.colour, .shallow_um = scene.shallow_um, .deep_um = scene.deep_um};
  if (scene.cell_colours != nullptr) options.cell_colours = &scene.cell_colours->of_cell;
  for (TileId id = 0; id < store.tile_count(); ++id) {
    const std::shared_ptr<const Tile> tile = store.load(id);
    const TileAppearance appearance = store.loadAppearance(id);
    for (const std::uint32_t cell : cellsWithOpenNodes(*tile)) addRoots(store, cell, roots);
    const SomaTable somata = somataIn(*tile, appearance, roots, finder);
    options.roots = &roots;
    options.somata = &somata;
    const NeuriteBatch batch = makeBatch(*tile, appearance, options);
    for (const DrawnSegment& segment : batch.segments) addShape(shapes, batch, segment, view, size, px_rad);
  }
  std::stable_sort(shapes.begin(), shapes.end(),
                   [](const Shape& a, const Shape& b) { return a.depth_um > b.depth_um; });
  for (const Shape& s : shapes) {
    if (s.a == s.b)
      canvas.disc(s.a, s.radius_a, s.colour);
    else
      canvas.taper(s.a, s.radius_a, s.b, s.radius_b, s.colour);
  }
}

}  // namespace filiform::tools
