#include "tools/commands/shared/travel_report.h"

#include "index/set/tile_set.h"
#include "tools/pictures/canvas.h"
#include "tools/pictures/plot.h"
#include "tools/pictures/png.h"
#include "viewer/gl/scene_view.h"
#include "viewer/scene/minimap.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace filiform::tools {

namespace {

std::string format(const char* pattern, double a, double b) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, a, b);
  return text;
}

// Draws the path, from a ring to an arrowhead, then title, legend and scale bar.
void drawOver(Picture& picture, const std::vector<Vector2d>& way, double um_px, const std::string& title,
              const std::string& subtitle) {
  constexpr Rgba kPath{255, 122, 30}, kBackground{20, 23, 31, 204}, kLetters{235, 238, 245}, kPale{160, 166, 180};
  Canvas canvas(picture);
  canvas.polyline(way, 6, kBackground);
  canvas.polyline(way, 2.8, kPath);
  if (!way.empty()) {
    canvas.disc(way.front(), 6.5, kPath);
    canvas.disc(way.front(), 3.5, kBackground);
    // The direction over the last ten pixels: a single tick is too short.
    const Vector2d end = way.back();
    Vector2d along(0, 0);
    for (std::size_t i = way.size(); i-- > 0 && along.norm() < 10;) along = end - way[i];
    const Vector2d back = -11 * along.normalized(), side(0.6 * back.y(), -0.6 * back.x());
    canvas.polyline({end + back + side, end, end + back - side}, 3, kPath);
  }
  canvas.fill(0, 0, std::max(canvas.textWidth(title, 12), canvas.textWidth(subtitle, 9)) + 32, 62, kBackground);
  canvas.text(title, {16, 27}, 12, kLetters);
  canvas.text(subtitle, {16, 48}, 9, kPale);
  const double bottom = picture.height - 22.0, right = picture.width - 24.0;
  const std::string legend = "path of the proxy";
  canvas.fill(8, bottom - 18, 72 + canvas.textWidth(legend, 9), bottom + 14, kBackground);
  canvas.line({16, bottom - 4}, {46, bottom - 4}, 2.8, kPath);
  canvas.text(legend, {56, bottom}, 9, kLetters);
  const ScaleBar bar = scaleBar(um_px, picture.width / 4.0);
  canvas.fill(right - bar.length_px - 8, bottom - 18, right + 8, bottom + 14, kBackground);
  canvas.fill(right - bar.length_px, bottom + 4, right, bottom + 8, kLetters);
  canvas.text(bar.text, {right - bar.length_px / 2, bottom - 2}, 9, kLetters, Align::centre);
}

}  // namespace

void TravelReport::add(const TickRow& row) {
  time_s_.push_back(row.time_s);
  force_N_.push_back(row.force_N.norm());
  if (way_W_.empty() || way_W_.back() != row.p_W) way_W_.push_back(row.p_W);
  if (row.frontier && !at_frontier_) frontier_s_.push_back(row.time_s);
  at_frontier_ = row.frontier;
}

void TravelReport::writeForcePlot(const std::string& path, const std::string& title, const RunSummary& summary) const {
  Plot plot;
  plot.title = "Force at the hand: " + title;
  plot.subtitle = toString(summary.outcome) + format(", %.0f of %.0f um", summary.reached_um, summary.route_um) +
                  format(", mean %.2f N, integral %.2f N s", summary.mean_force_N, summary.force_integral_Ns);
  plot.x_label = "time (s)";
  plot.y_label = "force (N)";
  plot.series.push_back({"force", time_s_, force_N_});
  constexpr std::size_t kMostLines = 20;
  if (frontier_s_.size() <= kMostLines)
    for (const double at : frontier_s_) plot.lines.push_back({at, "frontier"});
  writePng(drawPlot(plot), path);
}

void TravelReport::writePicture(const std::string& path, const std::string& title, const RunSummary& summary,
                                const TileStore& store) const {
  const auto* const set = dynamic_cast<const TileSet*>(&store);
  const std::unique_ptr<const Levels> levels = set != nullptr ? Levels::open(*set) : nullptr;
  const auto context = makeOffscreenContext();
  Renderer renderer(*context);
  SceneView scene(store, levels.get(), renderer);
  Vector3d lo_W = scene.usual_lo_W(), hi_W = scene.usual_hi_W();
  for (const Vector3d& p_W : way_W_) lo_W = lo_W.cwiseMin(p_W), hi_W = hi_W.cwiseMax(p_W);
  SceneFrame frame;
  const double height = 1200, width = std::clamp(height * (hi_W - lo_W).x() / (hi_W - lo_W).y(), 600.0, 2000.0);
  frame.size = {static_cast<int>(width), static_cast<int>(height)};
  frame.camera = parallel(overview(lo_W, hi_W, 0, 0, frame.size.aspect()));
  scene.drawWhole(frame);
  Picture picture = renderer.read();
  const EyeView view = viewOf(frame.camera, frame.size.aspect());
  std::vector<Vector2d> way;
  for (const Vector3d& p_W : way_W_) {
    const ScreenPoint at = project(view, p_W, frame.size);
    if (way.empty() || std::hypot(at.x - way.back().x(), at.y - way.back().y()) > 0.3) way.emplace_back(at.x, at.y);
  }
  drawOver(picture, way, frame.camera.focus_um / pixelsPerRadian(view.frustum, frame.size), title,
           toString(summary.outcome) + format(": %.0f of %.0f um travelled", summary.reached_um, summary.route_um));
  writePng(picture, path);
}

}  // namespace filiform::tools
