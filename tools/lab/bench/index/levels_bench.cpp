// bench levels: what levels of detail save, and how wrong they are on the screen: tolerance and segment budget against
// the error in pixels and the time of a frame.
#include "index/ingest/ingest.h"
#include "index/levels/levels.h"
#include "index/set/tile_set.h"
#include "tools/lab/bench/index/levels_zoom.h"
#include "tools/lab/bench/trade.h"
#include "tools/lab/bench/workloads.h"
#include "tools/synthetic/synthetic.h"
#include "viewer/gl/frame_governor.h"
#include "viewer/gl/scene_view.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

namespace filiform::tools {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kEnough_ms = 3000;  // time for one figure; a software renderer takes seconds a frame

struct Drawn {
  double segments = 0, error_px = 0, frame_ms = 0;
};

// The whole column, drawn without a display as `render` does.
class Overview {
 public:
  Overview(const TileSet& set, const Levels& levels, bool quick)
      : quick_(quick), context_(makeOffscreenContext()), renderer_(*context_), scene_(set, &levels, renderer_) {
    if (quick_) frame_.size = {160, 100};
    frame_.budget = FrameGovernor().budget();
    standard_ = frame_.budget;
    frame_.budget.samples = 1;
    frame_.moving = false;
  }

  const SceneBudget& standard() const { return standard_; }
  std::string renderer() const { return context_->description(); }
  PictureSize size() const { return frame_.size; }

  // Draws with every tile on the card and a turning camera. The median frame, timed until its last pixel.
  Drawn draw(std::uint64_t most, double enough_px) {
    frame_.budget.segments = most;
    frame_.budget.enough_px = enough_px;
    std::vector<double> ms;
    Drawn drawn;
    const auto begin = Clock::now();
    for (int i = 0; i < (quick_ ? 2 : 7); ++i) {
      if (i >= 3 && since_ms(begin) > kEnough_ms) break;
      frame_.camera = overview(scene_.lo_W(), scene_.hi_W(), 1e-3 * i, 0.2, frame_.size.aspect());
      if (i == 0) scene_.drawWhole(frame_);
      frame_.camera = orbit(frame_.camera, 1e-5, 0);
      const auto start = Clock::now();
      const SceneFigures figures = scene_.draw(frame_);
      renderer_.finish();
      if (figures.pending == 0) ms.push_back(since_ms(start));
      drawn.segments = static_cast<double>(figures.segments);
      drawn.error_px = figures.error_px;
    }
    drawn.frame_ms = percentile(ms, 0.5);
    return drawn;
  }

 private:
  bool quick_;
  std::unique_ptr<GraphicsContext> context_;
  Renderer renderer_;
  SceneView scene_;
  SceneFrame frame_;
  SceneBudget standard_;
};

void measureLoading(const BenchOptions& options, const TileSet& set, const Levels& levels, BenchReport& report) {
  const Grid grid = set.grid();
  const Vector3d lo = grid.toWorld(set.bounds().lo), hi = grid.toWorld(set.bounds().hi);
  // The whole column on a screen of 1080 rows, under 45 degrees.
  LevelView view;
  view.pixels_per_rad = 1080 / (2 * std::tan(0.3927));
  view.eye_W =
      0.5 * (lo + hi) + Vector3d(0, 0, 0.5 * (hi - lo).maxCoeff() / std::tan(0.3927) + 0.5 * (hi.z() - lo.z()));
  BenchTable table{
      "choice",
      "Levels of detail, the whole column on 1080 rows: what is allowed, what is chosen, the largest error "
      "on the screen (pixels), full-resolution segments that nothing stands for, and ms to load the parts",
      {"enough px", "segments", "error px", "left out", "parts", "load ms"},
      {}};
  for (const double enough : {0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
    options.progress("levels within " + shown(enough) + " pixels");
    const LevelChoice choice = levels.choose(view, std::numeric_limits<std::uint64_t>::max() / 2, enough);
    const auto start = Clock::now();
    std::size_t loaded = 0;
    for (const LevelPart& part : choice.parts)
      loaded += (part.level ? levels.load(part.tile) : set.load(part.tile))->segment_count();
    if (loaded == 0) throw std::logic_error("nothing was chosen");
    table.rows.push_back({enough, static_cast<std::int64_t>(choice.segments), choice.error_px,
                          static_cast<std::int64_t>(choice.hidden), static_cast<std::int64_t>(choice.parts.size()),
                          since_ms(start)});
    report.bounds.push_back({"levels, " + shown(enough) + " px asked for",
                             "error at most as asked, room given (levels.h)", enough, choice.error_px, "px"});
  }
  report.tables.push_back(std::move(table));
}

void measureOverviewFrames(const BenchOptions& options, const TileSet& set, const Levels& levels, BenchReport& report) {
  Overview overview(set, levels, options.quick);
  const SceneBudget standard = overview.standard();
  const auto all = set.counts().segments;
  BenchTable table{
      "frames",
      "The whole column, every tile on the card, one sample a pixel: segments allowed, tolerance (pixels), "
      "segments drawn, largest error (pixels), ms a frame",
      {"allowed", "tolerance px", "segments", "error px", "frame ms"},
      {},
      {"allowed", "tolerance px"}};
  const auto draw = [&](std::uint64_t most, double enough) {
    options.progress("frames of " + std::to_string(most) + " segments, " + shown(enough) + " pixels");
    const Drawn drawn = overview.draw(most, enough);
    table.rows.push_back({static_cast<std::int64_t>(most), enough, drawn.segments, drawn.error_px, drawn.frame_ms});
    return drawn;
  };
  PlotSeries budget_error{"largest error (pixels)", {}, {}}, budget_ms{"ms a frame", {}, {}};
  std::vector<std::uint64_t> budgets{10'000, 20'000, 50'000, 100'000, 200'000, 500'000};
  if (options.quick) budgets = {1000, 3000, 10'000};
  budgets.push_back(all);
  for (const std::uint64_t most : {standard.segments, standard.moving_segments})
    if (most < all && std::find(budgets.begin(), budgets.end(), most) == budgets.end()) budgets.push_back(most);
  std::sort(budgets.begin(), budgets.end());
  budgets.erase(std::remove_if(budgets.begin(), budgets.end(), [&](std::uint64_t n) { return n > all; }),
                budgets.end());
  const auto at = [](const PlotSeries& series, double x) {
    for (std::size_t i = 0; i < series.x.size(); ++i)
      if (series.x[i] == x) return series.y[i];
    return series.y.back();
  };
  for (const std::uint64_t most : budgets) {
    const Drawn drawn = draw(most, 0);
    budget_error.x.push_back(static_cast<double>(most)), budget_error.y.push_back(drawn.error_px);
    budget_ms.x.push_back(static_cast<double>(most)), budget_ms.y.push_back(drawn.frame_ms);
  }
  BenchCurve by_budget = tradeCurve("segment_budget", "Segments that a frame may draw: error on the screen and time",
                                    "segments allowed", "pixels; ms", {budget_error, budget_ms}, true, true);
  const auto rest = static_cast<double>(std::min(standard.segments, all)),
             moving = static_cast<double>(std::min(standard.moving_segments, all));
  addLine(by_budget, static_cast<double>(all), "exact");
  addLine(by_budget, rest, "default at rest");
  addLine(by_budget, moving, "default in motion");
  const std::string budget_knee = lineAtKnee(by_budget);
  by_budget.finding = "In motion at most " + shown(moving) + " segments, wrong by " + shown(at(budget_error, moving)) +
                      " px in " + shown(at(budget_ms, moving)) + " ms; at rest " + shown(rest) + ", " +
                      shown(at(budget_error, rest)) + " px, " + shown(at(budget_ms, rest)) +
                      " ms (error: " + budget_knee +
                      "). The defaults are this renderer's: with a graphics card 2e6. "
                      "Every frame is drawn as at rest, with one sample a pixel: in motion it is cheaper.";
  report.curves.push_back(std::move(by_budget));

  PlotSeries tolerance_ms{"ms a frame", {}, {}}, tolerance_segments{"segments drawn, thousands", {}, {}};
  for (const double enough :
       options.quick ? std::vector<double>{0.5, 2, 8} : std::vector<double>{0.125, 0.25, 0.5, 1, 2, 4, 8, 16}) {
    const Drawn drawn = draw(all, enough);
    tolerance_ms.x.push_back(enough), tolerance_ms.y.push_back(drawn.frame_ms);
    tolerance_segments.x.push_back(enough), tolerance_segments.y.push_back(1e-3 * drawn.segments);
    report.bounds.push_back({"picture at rest, " + shown(enough) + " px asked for",
                             "what is drawn is wrong by at most so much, room given (scene_view.h)", enough,
                             drawn.error_px, "px"});
  }
  BenchCurve by_tolerance =
      tradeCurve("tolerance", "Tolerance on the screen: time of a frame, and segments drawn", "tolerance (pixels)",
                 "ms; thousands of segments", {tolerance_ms, tolerance_segments}, true, true);
  addLine(by_tolerance, standard.enough_px, "default");
  const std::string tolerance_knee = lineAtKnee(by_tolerance);
  by_tolerance.finding = "Half a pixel, the default, takes " + shown(at(tolerance_ms, standard.enough_px)) +
                         " ms and cannot be seen; four pixels take " + shown(at(tolerance_ms, 4)) + " ms (" +
                         tolerance_knee + "). Exact is a tolerance of 0, which a logarithmic axis cannot show.";
  report.curves.push_back(std::move(by_tolerance));
  report.tables.push_back(std::move(table));
  report.notes.push_back("Drawn by " + overview.renderer() + ", " + std::to_string(overview.size().width) + " x " +
                         std::to_string(overview.size().height) + " pixels; " + std::to_string(all) +
                         " segments in the column.");
}

// Compares every level with every segment that it represents, on a small set because this is slow.
void checkSmall(const BenchOptions& options, const std::string& path, BenchReport& report) {
  options.progress("checking every level");
  SyntheticOptions few;
  few.cells = options.quick ? 2 : 4;
  few.seed = options.seed;
  SyntheticCells small(few);
  ingest(small, path, {.levels = true});
  const auto set = TileSet::open(path);
  const auto levels = Levels::open(*set);
  report.bounds.push_back({"levels of detail, each tile of " + std::to_string(few.cells) + " cells",
                           "all but those said to be left out lie within its error (levels.h); tiles where not", 0,
                           static_cast<double>(checkLevels(*set, *levels).size()), "tiles"});
}

BenchReport runLevels(const BenchOptions& options) {
  BenchReport report;
  const WorkFolder folder(options.out, "levels");
  options.progress("a set with levels of detail");
  const std::string path = folder.path() + "/levels.fil";
  SyntheticOptions column;
  column.cells = static_cast<std::uint32_t>(options.quick ? 4 : 220);
  column.seed = options.seed;
  SyntheticCells cells(column);
  ingest(cells, path, {.levels = true});
  const auto set = TileSet::open(path);
  const auto levels = Levels::open(*set);
  measureLoading(options, *set, *levels, report);
  checkSmall(options, folder.path() + "/few.fil", report);
  try {
    measureOverviewFrames(options, *set, *levels, report);
    measureZoom(*set, *levels, options.quick ? 3000 : 200'000, options.quick, options.progress, report);
  } catch (const GraphicsError& error) {
    report.notes.push_back(std::string("No frames: ") + error.what());
  }
  return report;
}

}  // namespace

void addLevelsWorkloads(std::vector<Workload>& all) {
  all.push_back({"levels", "levels of detail: tolerance and segment budget against pixels and frame time", runLevels});
}

}  // namespace filiform::tools
