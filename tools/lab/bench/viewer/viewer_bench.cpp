// bench viewer: the time of a frame at rest, in motion and while tiles arrive; the time to the first picture; the
// effect on the haptic loop.
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "solver/travel/places/place_finder.h"
#include "solver/travel/session/session.h"
#include "solver/workspace/workspace.h"
#include "tools/lab/bench/viewer/stage.h"
#include "tools/lab/bench/workloads.h"
#include "viewer/gl/frame_governor.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace filiform::tools {

namespace {

using Clock = std::chrono::steady_clock;

Camera overviewOf(const SceneView& scene, const SceneFrame& frame, double yaw_rad) {
  return overview(scene.lo_W(), scene.hi_W(), yaw_rad, 0.2, frame.size.aspect());
}
// Moves the workspace through the middle of the tissue, as a user travels; `part`: 0 to 1.
void placeInside(const SceneView& scene, double part, Workspace& workspace, SceneFrame& frame) {
  const Vector3d size = scene.hi_W() - scene.lo_W();
  const Vector3d from = scene.lo_W() + size.cwiseProduct(Vector3d(0.3, 0.25, 0.4));
  const Vector3d to = scene.lo_W() + size.cwiseProduct(Vector3d(0.7, 0.75, 0.6));
  workspace.place(from + part * (to - from), workspace.centre_D());
  frame.workspace = &workspace;
  frame.camera = workspaceCamera(workspace, frame.size.aspect());
}
constexpr double kZoom_um = 200;

void measureFrames(Stage& stage, const BenchOptions& options, const SceneFrame& base, BenchReport& report) {
  BenchTable table{
      "frames",
      "A frame at " + std::to_string(base.size.width) + " x " + std::to_string(base.size.height) +
          " with every tile on the card and the camera turning, ms",
      {"view", "budget", "segments", "lines", "cones", "samples", "shading", "median", "most", "cpu", "frames"},
      {},
      {"view", "budget", "samples"}};
  const bool software = isSoftwareRenderer(stage.context->description());
  const std::uint64_t most = software ? 200'000 : 2'000'000, promised = software ? 50'000 : 2'000'000;
  Workspace workspace({.zoom_um = kZoom_um});
  double worst_ms = 0;
  for (const bool inside : {false, true})
    for (std::uint64_t budget : {std::uint64_t{10'000}, std::uint64_t{50'000}, most}) {
      if (options.quick) budget = 2000;
      for (const int samples : {1, 2}) {
        options.progress("frames of " + std::to_string(budget) + " segments");
        SceneFrame frame = base;
        frame.budget.segments = frame.budget.moving_segments = budget;
        frame.budget.samples = frame.budget.moving_samples = samples;
        frame.budget.moving_shade = samples > 1;
        frame.budget.enough_px = 0;
        const int frames = options.quick ? 3 : software ? 5 : 20;
        // The same path twice: the first pass loads and uploads.
        std::vector<double> times, cpu;
        for (const bool measured : {false, true})
          for (int i = 0; i < frames; ++i) {
            if (inside) {
              placeInside(stage.scene, 0.3, workspace, frame);
              frame.camera = orbit(frame.camera, 0.005 * i, 0);
            } else {
              frame.camera = overviewOf(stage.scene, frame, 0.005 * i);
            }
            frame.time_s += 0.03;
            if (!measured) {
              stage.settle(frame);
            } else {
              times.push_back(stage.frame(frame));
              cpu.push_back(stage.frame_cpu_ms);
            }
          }
        const double median = percentile(times, 0.5);
        table.rows.push_back({std::string(inside ? "inside" : "overview"), static_cast<std::int64_t>(budget),
                              static_cast<std::int64_t>(stage.figures.segments),
                              static_cast<std::int64_t>(stage.figures.drawn.lines),
                              static_cast<std::int64_t>(stage.figures.drawn.cones), static_cast<std::int64_t>(samples),
                              std::string(samples > 1 ? "yes" : "no"), median, percentile(times, 1),
                              percentile(cpu, 0.5), static_cast<std::int64_t>(frames)});
        if (samples == 1 && budget == promised) worst_ms = std::max(worst_ms, median);
      }
      if (options.quick) break;
    }
  report.tables.push_back(std::move(table));
  const double must_ms = software ? 60 : 1000.0 / 60;
  report.goals.push_back({std::to_string(promised) + " visible segments, ms a frame", software ? "<= 60" : "<= 16.7",
                          software ? "<= 40" : "<= 8", worst_ms, worst_ms <= must_ms, worst_ms <= (software ? 40 : 8)});
}

// Compares frames with and without batches behind the eye.
void measureCulling(Stage& stage, const BenchOptions& options, const SceneFrame& base, BenchReport& report) {
  options.progress("culling");
  SceneFrame frame = base;
  frame.budget.samples = 1;
  frame.moving = false;
  frame.camera = overviewOf(stage.scene, frame, 0);
  frame.budget.segments = options.quick ? 1000 : 20'000;
  stage.settle(frame);
  const Vector3d behind_W = frame.camera.eye_W + 1000 * frame.camera.rotation_VW.row(2).transpose();
  NeuriteBatch batch;
  batch.origin_W = batch.lo_W = batch.hi_W = behind_W;
  batch.segments.resize(2048);
  constexpr Renderer::BatchId kFirst = Renderer::BatchId{1} << 50;
  constexpr int kCulled = 500;
  const int frames = options.quick ? 3 : isSoftwareRenderer(stage.context->description()) ? 20 : 30;
  const auto median = [&] {
    std::vector<double> times;
    for (int i = 0; i < frames; ++i) {
      frame.camera = orbit(frame.camera, 1e-4, 0);
      times.push_back(stage.frame(frame));
    }
    return percentile(times, 0.5);
  };
  std::vector<double> with, without;
  for (int round = 0; round < 3; ++round) {
    without.push_back(median());
    for (int i = 0; i < kCulled; ++i) stage.renderer.put(kFirst + static_cast<Renderer::BatchId>(i), batch);
    with.push_back(median());
    for (int i = 0; i < kCulled; ++i) stage.renderer.remove(kFirst + static_cast<Renderer::BatchId>(i));
  }
  const double more_ms = percentile(with, 0.5) - percentile(without, 0.5);
  report.tables.push_back({"culled",
                           "500 tiles of 2048 segments behind the eye, ms a frame",
                           {"without", "with", "difference"},
                           {{percentile(without, 0.5), percentile(with, 0.5), more_ms}}});
  const double part = std::abs(more_ms) / percentile(without, 0.5);
  report.goals.push_back({"culled tiles, part of a frame", "<= 0.05", "<= 0.01", part, part <= 0.05, part <= 0.01});
}

// Flies through the set at a steady pace: once while tiles arrive, and again with the tiles of the first flight.
void measureStreaming(const std::string& path, const BenchOptions& options, const SceneFrame& base,
                      BenchReport& report) {
  BenchTable table{"streaming",
                   "A flight through the set, ms a frame; the second finds its tiles on the card",
                   {"flight", "frames", "median", "p90", "most", "most / median", "cpu median", "cpu most", "uploads",
                    "frames with uploads", "largest upload", "mean pending"},
                   {}};
  Stage stage(path);
  double ratio = 0;
  for (const bool again : {false, true}) {
    options.progress(again ? "the flight again" : "a flight");
    const int frames = options.quick ? 5 : isSoftwareRenderer(stage.context->description()) ? 50 : 200;
    std::vector<double> times, cpu;
    std::int64_t uploads = 0, uploading = 0;
    double largest_ms = 0, pending = 0;
    SceneFrame frame = base;
    Workspace workspace({.zoom_um = kZoom_um});
    frame.moving = true;
    for (int i = 0; i < frames; ++i) {
      placeInside(stage.scene, static_cast<double>(i) / frames, workspace, frame);
      frame.time_s += 0.05;
      times.push_back(stage.frame(frame));
      cpu.push_back(stage.frame_cpu_ms);
      uploads += stage.figures.uploads;
      uploading += stage.figures.uploads > 0;
      largest_ms = std::max(largest_ms, stage.figures.upload_ms);
      pending += static_cast<double>(stage.figures.pending) / frames;
    }
    const double median = percentile(times, 0.5), most = *std::max_element(times.begin(), times.end());
    if (!again) ratio = most / median;
    table.rows.push_back({std::string(again ? "second" : "first"), static_cast<std::int64_t>(frames), median,
                          percentile(times, 0.9), most, most / median, percentile(cpu, 0.5),
                          *std::max_element(cpu.begin(), cpu.end()), uploads, uploading, largest_ms, pending});
  }
  report.tables.push_back(std::move(table));
  report.goals.push_back({"slowest frame of a flight with tiles arriving, times the median", "<= 2", "<= 1.5", ratio,
                          ratio <= 2, ratio <= 1.5});
}

void measureStart(const std::string& path, const BenchOptions& options, const SceneFrame& base, BenchReport& report) {
  options.progress("the first picture");
  const double cpu_start_ms = cpu_ms();
  const Clock::time_point start = Clock::now();
  Stage stage(path);
  const double opened_ms = since_ms(start);
  SceneFrame frame = base;
  frame.camera = overviewOf(stage.scene, frame, 0);
  double first_ms = 0, most_ms = 0;
  for (;;) {
    frame.time_s = 1e-3 * since_ms(start);
    most_ms = std::max(most_ms, stage.frame(frame));
    if (first_ms == 0 && stage.figures.segments > 0 && !stage.figures.has_gaps) first_ms = since_ms(start);
    if (stage.figures.complete && !stage.figures.moving) break;
    stage.scene.waitForTiles(0.01);
  }
  const double whole_ms = since_ms(start), whole_cpu_ms = cpu_ms() - cpu_start_ms;
  std::uint64_t all = 0;
  for (TileId tile = 0; tile < stage.set->tile_count(); ++tile) all += stage.set->entry(tile).owned;
  report.tables.push_back(
      {"start",
       "From nothing to a picture of the whole set, ms",
       {"segments in the set", "levels", "opened", "first picture", "refined", "slowest frame", "segments drawn",
        "error px", "left out", "cpu until refined"},
       {{static_cast<std::int64_t>(all), std::string(stage.levels != nullptr ? "yes" : "no"), opened_ms, first_ms,
         whole_ms, most_ms, static_cast<std::int64_t>(stage.figures.segments), stage.figures.error_px,
         static_cast<std::int64_t>(stage.figures.left_out), whole_cpu_ms}}});
  report.goals.push_back(
      {"first picture after start, s", "<= 1", "<= 0.5", first_ms / 1000, first_ms <= 1000, first_ms <= 500});
  report.goals.push_back({"refined to the full budget after start, s", "<= 3", "<= 2", whole_ms / 1000,
                          whole_ms <= 3000, whole_ms <= 2000});

  // At rest, no part may be more wrong than stated.
  options.progress("errors at rest");
  double over_px = 0;
  Workspace workspace({.zoom_um = kZoom_um});
  frame.moving = false;
  for (int i = 0; i < (options.quick ? 2 : 8); ++i) {
    frame.workspace = nullptr;
    if (i % 2 == 0)
      frame.camera = orbit(overviewOf(stage.scene, frame, 0.5 * i), 0, 0.1 * i, 1 / (1 + 0.1 * i));
    else
      placeInside(stage.scene, i / 12.0, workspace, frame);
    stage.settle(frame);
    if (std::isfinite(stage.figures.error_px))
      over_px =
          std::max(over_px, stage.figures.error_px - std::max(stage.figures.wanted_error_px, frame.budget.enough_px));
    if (stage.figures.stand_ins > 0) throw std::runtime_error("a picture at rest has a tile that only stands in");
  }
  report.goals.push_back({"error at rest above the stated one, px", "0", "0", over_px, over_px <= 0, over_px <= 0});
}

// The haptic loop at 1 kHz with a simulated hand: alone, beside continuous drawing, and alone again.
void measureLoop(const std::string& path, const BenchOptions& options, const SceneFrame& base, BenchReport& report) {
  BenchTable table{"loop",
                   "The haptic loop, a simulated hand travelling, beside the viewer; us",
                   {"viewer", "ticks", "missed deadlines", "missed, part", "interruptions", "wake p99", "wake p99.9",
                    "compute p99", "compute p99.9", "compute most", "frames", "frame median, ms"},
                   {}};
  Stage stage(path);
  const PlaceFinder finder(*stage.set);
  const Vector3d middle_W = (stage.scene.lo_W() + stage.scene.hi_W()) / 2;
  const auto start = finder.nearest(middle_W);
  if (!start) throw std::runtime_error("the set has no segment");
  std::vector<std::string> refused;
  double missed_beside = 0;
  for (const char* viewer : {"none", "drawing", "none again"}) {
    options.progress(std::string("the loop, viewer: ") + viewer);
    const bool draws = std::string(viewer) == "drawing";
    Session session(*stage.set, {.zoom_um = kZoom_um});
    session.start();
    session.jump(start->place);
    Workspace workspace(session.workspaceOptions());
    SceneFrame frame = base;
    frame.moving = true;
    std::vector<double> times;
    const Clock::time_point begin = Clock::now();
    const double most_ms = options.quick ? 300 : 10'000;
    for (double now_ms = 0; now_ms < most_ms; now_ms = since_ms(begin)) {
      const NavigationSnapshot& now = session.update();
      const double turn_rad = 0.001 * now_ms;
      session.point(Pointing::push(0.006 * Vector3d(std::cos(turn_rad), std::sin(turn_rad), std::sin(0.3 * turn_rad))));
      if (draws && now.tick > 0) {
        workspace.lay(now.centre_W, now.rotation_WD, now.zoom_um);
        frame.workspace = &workspace;
        frame.camera = orbit(workspaceCamera(workspace, frame.size.aspect()), 0.3 * turn_rad, 0);
        frame.proxy_W = now.p_W;
        frame.time_s = 1e-3 * now_ms;
        times.push_back(stage.frame(frame));
      } else {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    }
    session.finish();
    for (const std::string& note : session.takeNotes())
      if (note.find("refused") != std::string::npos) refused.push_back(note);
    const LoopMetrics& loop = *session.metrics();
    const auto us = [](std::int64_t ns) { return 1e-3 * static_cast<double>(ns); };
    const double part =
        static_cast<double>(loop.missed_deadlines()) / static_cast<double>(std::max<std::uint64_t>(loop.ticks(), 1));
    if (draws) missed_beside = part;
    table.rows.push_back({std::string(viewer), static_cast<std::int64_t>(loop.ticks()),
                          static_cast<std::int64_t>(loop.missed_deadlines()), part,
                          static_cast<std::int64_t>(session.interruptions()), us(loop.wake().percentile_ns(0.99)),
                          us(loop.wake().percentile_ns(0.999)), us(loop.compute().percentile_ns(0.99)),
                          us(loop.compute().percentile_ns(0.999)), us(loop.compute().max_ns()),
                          static_cast<std::int64_t>(times.size()), times.empty() ? 0.0 : percentile(times, 0.5)});
  }
  report.tables.push_back(std::move(table));
  if (refused.empty())
    report.goals.push_back({"deadlines missed beside the viewer, part, with real-time priority", "<= 0.001",
                            "<= 0.0001", missed_beside, missed_beside <= 0.001, missed_beside <= 0.0001});
  else
    report.notes.push_back("No promise about missed deadlines, as the loop had no real-time priority: " +
                           refused.front());
}

BenchReport runViewer(const BenchOptions& options) {
  BenchReport report;
  const BenchScene scene(options);
  const std::string& path = scene.path();
  SceneFrame base;
  if (options.quick) base.size = {160, 100};
  {
    Stage stage(path);
    base.budget = FrameGovernor().budget();
    report.notes.push_back("Drawn by " + stage.context->description() + ".");
    report.notes.push_back(
        "A frame is timed until its last pixel is drawn. Samples: across a pixel, in each direction. What is drawn "
        "while the camera moves has one sample with a software renderer, at rest two. "
        "cpu: processor time of all threads in a frame, that of the loading thread included.");
    std::array<double, 3> load{};
    if (::getloadavg(load.data(), 1) == 1) {
      std::ostringstream text;
      text << "Load of the machine at the start: " << shown(load[0]) << '.';
      report.notes.push_back(text.str());
    }
    measureFrames(stage, options, base, report);
    measureCulling(stage, options, base, report);
  }
  measureStreaming(path, options, base, report);
  measureMotion(path, options, base, report);
  measureStart(path, options, base, report);
  measureLoop(path, options, base, report);
  return report;
}

}  // namespace

void addViewerWorkloads(std::vector<Workload>& all) {
  all.push_back({"viewer", "frames, culling, streaming, motion, the first picture, the loop beside it", runViewer});
  all.push_back({"motion", "frames in motion: times, errors, calls of OpenGL, bytes, shaded fragments", runMotion});
}

}  // namespace filiform::tools
