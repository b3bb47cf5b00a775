#include "tools/lab/bench/index/levels_zoom.h"

#include "index/query/nearest.h"
#include "tools/lab/bench/trade.h"
#include "viewer/gl/frame_governor.h"
#include "viewer/gl/scene_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace filiform::tools {

namespace {

constexpr int kZoomSteps = 10;
constexpr double kLast_um = 15;
constexpr int kBlock = 8;     // pixels
constexpr int kDense = 60;    // covered pixels of a block, of 64
constexpr double kFar = 0.1;  // a block differs

struct ZoomPicture {
  Picture picture;
  std::uint64_t segments = 0;
  double error_px = 0;
};

// Covered pixels and their brightness, in all and by block.
struct Density {
  double coverage = 0, brightness = 0;
  std::vector<std::array<double, 2>> blocks;

  Density(const Picture& picture, const std::array<int, 3>& background) {
    const int across = picture.width / kBlock, down = picture.height / kBlock;
    blocks.assign(static_cast<std::size_t>(across) * static_cast<std::size_t>(down), {0, 0});
    for (int y = 0; y < down * kBlock; ++y)
      for (int x = 0; x < across * kBlock; ++x) {
        const std::uint8_t* rgb =
            &picture.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                              static_cast<std::size_t>(x))];
        double light = 0;
        for (std::size_t i = 0; i < 3; ++i) light += std::max(0, rgb[i] - background[i]);
        if (light <= 0) continue;
        std::array<double, 2>& block = blocks[static_cast<std::size_t>(y / kBlock * across + x / kBlock)];
        block[0] += 1;
        block[1] += light;
        coverage += 1;
        brightness += light;
      }
  }
};

double change(double now, double before) { return before > 0 ? now / before - 1 : 0; }

}  // namespace

void measureZoom(const TileSet& set, const Levels& levels, std::uint64_t segments, bool quick,
                 const std::function<void(const std::string&)>& progress, BenchReport& report) {
  const auto context = makeOffscreenContext();
  Renderer renderer(*context);
  SceneView scene(set, &levels, renderer);
  SceneFrame frame;
  if (quick) frame.size = {320, 200};
  frame.budget = FrameGovernor().budget();
  frame.budget.samples = 1;
  frame.moving = false;
  const double enough_px = frame.budget.enough_px;

  const Vector3d lo_W = scene.usual_lo_W(), hi_W = scene.usual_hi_W();
  const Vector3d target_W = Nearest(set).find(0.5 * (lo_W + hi_W)).front().p_W;
  const auto dark = RenderOptions{}.background;
  const std::array<int, 3> background{dark.r, dark.g, dark.b};
  const Camera whole = overview(lo_W, hi_W, 0, 0.2, frame.size.aspect());
  const Vector3d away = (whole.eye_W - whole.focus_W()).normalized();
  const auto draw = [&](double distance_um, std::uint64_t most, double enough) {
    frame.camera = lookAt(target_W + distance_um * away, target_W);
    frame.budget.segments = most;
    frame.budget.enough_px = enough;
    const SceneFigures figures = scene.drawWhole(frame);
    return ZoomPicture{renderer.read(), figures.segments, figures.error_px};
  };

  BenchTable table{"zoom",
                   "A zoom from the whole to one neurite, at most " + std::to_string(segments) +
                       " segments a picture, beside pictures of every segment: segments drawn, largest error (pixels), "
                       "coverage and brightness against the picture of every segment (%), their change since the step "
                       "before (points), dense blocks of 8 x 8 pixels that differ by more than 10 % (%)",
                   {"distance um", "drawn", "error px", "coverage %", "brightness %", "coverage step",
                    "brightness step", "blocks coverage %", "blocks brightness %"},
                   {}};
  double most_coverage = 0, most_brightness = 0;
  std::array<double, 2> before{};
  for (int i = 0; i < kZoomSteps; ++i) {
    const double distance_um = whole.focus_um * std::pow(kLast_um / whole.focus_um, i / (kZoomSteps - 1.0));
    progress("zoom, " + shown(distance_um) + " um");
    const ZoomPicture chosen = draw(distance_um, segments, enough_px),
                      every = draw(distance_um, std::numeric_limits<std::uint64_t>::max() / 2, 0);
    const Density some(chosen.picture, background), all(every.picture, background);
    const std::array<double, 2> differs{100 * change(some.coverage, all.coverage),
                                        100 * change(some.brightness, all.brightness)};
    std::array<double, 2> far{};
    double dense = 0;
    for (std::size_t b = 0; b < all.blocks.size(); ++b) {
      if (all.blocks[b][0] < kDense) continue;
      dense += 1;
      for (std::size_t k = 0; k < 2; ++k) far[k] += std::abs(change(some.blocks[b][k], all.blocks[b][k])) > kFar;
    }
    const std::array<double, 2> step{i == 0 ? 0 : differs[0] - before[0], i == 0 ? 0 : differs[1] - before[1]};
    before = differs;
    most_coverage = std::max(most_coverage, std::abs(step[0]));
    most_brightness = std::max(most_brightness, std::abs(step[1]));
    const auto percent = [dense](double n) { return dense > 0 ? 100 * n / dense : 0; };
    table.rows.push_back({distance_um, static_cast<std::int64_t>(chosen.segments), chosen.error_px, differs[0],
                          differs[1], step[0], step[1], percent(far[0]), percent(far[1])});
  }
  report.tables.push_back(std::move(table));
  constexpr double kMostStep = 15;
  report.bounds.push_back({"zoom in ten steps: coverage",
                           "no jump in density: change from step to step, against the picture "
                           "of every segment",
                           kMostStep, most_coverage, "points"});
  report.bounds.push_back({"zoom in ten steps: brightness",
                           "no jump in density: change from step to step, against the "
                           "picture of every segment",
                           kMostStep, most_brightness, "points"});
}

}  // namespace filiform::tools
