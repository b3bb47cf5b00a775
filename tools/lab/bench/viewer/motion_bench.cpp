// bench motion: what moves in the window: errors on the screen, times, calls of OpenGL, bytes and shaded fragments.
#include "index/ingest/ingest.h"
#include "solver/travel/places/place_finder.h"
#include "solver/workspace/workspace.h"
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/viewer/stage.h"
#include "viewer/gl/frame_governor.h"

#include <algorithm>
#include <cmath>
#include <epoxy/gl.h>
#include <functional>
#include <tuple>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

using Clock = std::chrono::steady_clock;

// Counts calls of the functions of OpenGL that frames use, while it lives. `kFunction`: libepoxy's pointer to it, which
// must have been called before.
std::uint64_t gl_calls = 0;
template <auto kFunction>
class CountedCall;
template <class Result, class... Args, Result (**kFunction)(Args...)>
class CountedCall<kFunction> {
 public:
  CountedCall() {
    own_ = std::exchange(*kFunction, [](Args... args) -> Result {
      ++gl_calls;
      return own_(args...);
    });
  }
  ~CountedCall() { *kFunction = own_; }
  CountedCall(const CountedCall&) = delete;
  CountedCall& operator=(const CountedCall&) = delete;

 private:
  static inline Result (*own_)(Args...) = nullptr;
};
using CountedCalls =
    std::tuple<CountedCall<&epoxy_glDrawArrays>, CountedCall<&epoxy_glDrawArraysInstanced>,
               CountedCall<&epoxy_glDrawArraysInstancedBaseInstance>, CountedCall<&epoxy_glBindVertexArray>,
               CountedCall<&epoxy_glVertexAttribPointer>, CountedCall<&epoxy_glBindBuffer>,
               CountedCall<&epoxy_glBufferData>, CountedCall<&epoxy_glUseProgram>, CountedCall<&epoxy_glUniform1fv>,
               CountedCall<&epoxy_glUniform2fv>, CountedCall<&epoxy_glUniform3fv>, CountedCall<&epoxy_glUniform4fv>,
               CountedCall<&epoxy_glUniformMatrix3fv>, CountedCall<&epoxy_glBindFramebuffer>,
               CountedCall<&epoxy_glViewport>, CountedCall<&epoxy_glClear>, CountedCall<&epoxy_glEnable>,
               CountedCall<&epoxy_glDisable>, CountedCall<&epoxy_glBindTexture>, CountedCall<&epoxy_glReadPixels>,
               CountedCall<&epoxy_glGetError>>;

// Counts executions of the fragment shaders between begin() and end(), if the driver can.
class ShadedFragments {
 public:
  ShadedFragments() : can_count_(epoxy_has_gl_extension("GL_ARB_pipeline_statistics_query")) {
    if (can_count_) glGenQueries(1, &query_);
  }
  ~ShadedFragments() {
    if (can_count_) glDeleteQueries(1, &query_);
  }
  ShadedFragments(const ShadedFragments&) = delete;
  ShadedFragments& operator=(const ShadedFragments&) = delete;
  void begin() const {
    if (can_count_) glBeginQuery(GL_FRAGMENT_SHADER_INVOCATIONS_ARB, query_);
  }
  double end() const {  // NaN: the driver does not count
    if (!can_count_) return std::nan("");
    glEndQuery(GL_FRAGMENT_SHADER_INVOCATIONS_ARB);
    GLuint64 count = 0;
    glGetQueryObjectui64v(query_, GL_QUERY_RESULT, &count);
    return static_cast<double>(count);
  }

 private:
  bool can_count_;
  GLuint query_ = 0;
};

}  // namespace

BenchScene::BenchScene(const BenchOptions& options) : path_(options.scene) {
  if (!path_.empty()) return;
  const std::uint64_t segments = options.segments != 0 ? options.segments : options.quick ? 20'000 : 2'000'000;
  options.progress("a set of " + std::to_string(segments) + " segments");
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  folder_.emplace(options.out, "viewer");
  path_ = folder_->path() + "/set.fil";
  DenseCells cells(library, segments, 0.1, options.seed);
  IngestOptions ingest_options;
  ingest_options.levels = true;
  ingest(cells, path_, ingest_options);
}

void measureMotion(const std::string& path, const BenchOptions& options, const SceneFrame& base, BenchReport& report) {
  BenchTable table{
      "motion",
      "Frames in motion with the budgets of the window. Error: of the drawn tiles, px; none: the eye is "
      "inside a coarse tile. Answer: from a frame's begin, when the view changes for the next one, until a "
      "picture shows it. Calls: of OpenGL. Shaded: executions of fragment shaders a pixel",
      {"view", "frames", "pictures", "frame, ms", "most", "picture, ms", "most, ms", "answer most, ms", "segments",
       "error", "error p90", "error most", "none", "calls", "calls most", "uploaded, KiB", "shaded", "shaded most"},
      {}};
  Stage stage(path);
  const PlaceFinder finder(*stage.set);
  std::uint32_t largest = 0;
  for (std::uint32_t cell = 0; cell < stage.set->cell_count(); ++cell)
    if (stage.set->cell(cell).segments > stage.set->cell(largest).segments) largest = cell;
  const ProxyPlace start = finder.soma(largest);
  const double seconds = options.quick ? 0.3 : 4;
  const ShadedFragments shaded;
  double worst_px = 0, worst_ms = 0;
  const auto measure = [&](const char* name, const std::function<void(double, Workspace&, SceneFrame&)>& move) {
    options.progress(std::string("motion: ") + name);
    FrameGovernor governor;
    SceneFrame frame = base;
    Workspace workspace({.zoom_um = 300});
    workspace.place(start.p_W, workspace.centre_D());
    if (std::string(name) != "overview, turning") {
      frame.cells = {start.segment.cell};
      frame.proxy_W = start.p_W;
    }
    double most_ms = 0, answer_ms = 0, shaded_px = 0;
    std::vector<double> times, pictures, errors, calls, fragments, segments;
    std::int64_t none = 0;
    std::uint64_t uploaded = 0;
    const Clock::time_point begin = Clock::now();
    const auto draw = [&](double part) {
      move(part, workspace, frame);
      frame.budget = governor.budget();
      frame.time_s = 1e-3 * since_ms(begin);
      const double ms = stage.frame(frame);
      governor.drew(stage.figures);
      return ms;
    };
    // At rest: all tiles, and the budget that the window then has.
    for (int still = 0; still < 3; still = stage.figures.complete && !stage.figures.moving ? still + 1 : 0) {
      draw(0);
      if (stage.figures.pending > 0) stage.scene.waitForTiles(0.01);
      if (since_ms(begin) > 60'000) break;
    }
    const CountedCalls counted;
    const Clock::time_point moves = Clock::now();
    double asked_ms = 0, begun_ms = 0;  // of the earliest view that no picture shows; of this frame
    for (double part = 0; part < 1; part = 1e-3 * since_ms(moves) / seconds) {
      begun_ms = since_ms(moves);
      const std::uint64_t calls_before = gl_calls;
      shaded.begin();
      times.push_back(draw(part));
      shaded_px += shaded.end() / (base.size.width * base.size.height);
      calls.push_back(static_cast<double>(gl_calls - calls_before));
      uploaded += stage.figures.upload_bytes;
      if (!stage.figures.redrawn) continue;
      answer_ms = std::max(answer_ms, since_ms(moves) - asked_ms);
      asked_ms = begun_ms;
      most_ms = std::max(most_ms, stage.figures.picture_ms);
      pictures.push_back(stage.figures.picture_ms);
      fragments.push_back(std::exchange(shaded_px, 0));
      segments.push_back(static_cast<double>(stage.figures.segments));
      if (std::isfinite(stage.figures.error_px))
        errors.push_back(stage.figures.error_px);
      else
        ++none;
    }
    const double p90 = percentile(errors, 0.9);
    worst_px = std::max(worst_px, p90);
    worst_ms = std::max(worst_ms, answer_ms);
    table.rows.push_back({std::string(name), static_cast<std::int64_t>(times.size()),
                          static_cast<std::int64_t>(pictures.size()), percentile(times, 0.5), percentile(times, 1),
                          percentile(pictures, 0.5), most_ms, answer_ms, percentile(segments, 0.5),
                          percentile(errors, 0.5), p90, percentile(errors, 1), none, percentile(calls, 0.5),
                          percentile(calls, 1), static_cast<double>(uploaded) / 1024, percentile(fragments, 0.5),
                          percentile(fragments, 1)});
  };
  measure("overview, turning", [&](double part, Workspace&, SceneFrame& frame) {
    frame.camera = overview(stage.scene.usual_lo_W(), stage.scene.usual_hi_W(), part, 0.2, base.size.aspect());
  });
  const auto lookFrom = [&](Workspace& workspace, SceneFrame& frame) {
    frame.workspace = &workspace;
    frame.camera = workspaceCamera(workspace, base.size.aspect());
  };
  measure("inside, turning", [&](double part, Workspace& workspace, SceneFrame& frame) {
    lookFrom(workspace, frame);
    frame.camera = orbit(frame.camera, 2 * part, 0.2 * part);
  });
  for (const double near_um : {10.0, 1e-6})
    measure(near_um == 10 ? "inside, zooming to 10 um and back" : "inside, zooming to 1e-6 um and back",
            [&, near_um](double part, Workspace& workspace, SceneFrame& frame) {
              workspace.lay(start.p_W, Eigen::Quaterniond(workspace.rotationMatrix()),
                            300 * std::pow(near_um / 300, 1 - std::abs(1 - 2 * part)));
              lookFrom(workspace, frame);
            });
  measure("inside, 300 um along x", [&](double part, Workspace& workspace, SceneFrame& frame) {
    workspace.place(start.p_W + Vector3d(300 * part, 0, 0), workspace.centre_D());
    lookFrom(workspace, frame);
  });
  report.tables.push_back(std::move(table));
  report.goals.push_back(
      {"error in motion, p90 of a view, px", "<= 8", "<= 4", worst_px, worst_px <= 8, worst_px <= 4});
  report.goals.push_back(
      {"longest answer in motion, ms", "<= 150", "<= 100", worst_ms, worst_ms <= 150, worst_ms <= 100});
}

BenchReport runMotion(const BenchOptions& options) {
  BenchReport report;
  const BenchScene scene(options);
  SceneFrame base;
  base.size = options.quick ? PictureSize{160, 100} : PictureSize{1280, 800};
  measureMotion(scene.path(), options, base, report);
  return report;
}

}  // namespace filiform::tools
