// What the workloads of the viewer share: a set, and everything that draws it. Thread rule: the thread of the context.
#pragma once

#include "index/set/tile_set.h"
#include "tools/lab/bench/bench.h"
#include "viewer/gl/scene_view.h"

#include <chrono>
#include <ctime>
#include <memory>
#include <optional>
#include <string>

namespace filiform::tools {

// Processor time of all threads of the program: the cost of a frame on a busy machine.
inline double cpu_ms() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

// Everything that draws, opened as the program opens it.
struct Stage {
  explicit Stage(const std::string& path)
      : set(TileSet::open(path)),
        levels(Levels::open(*set)),
        context(makeOffscreenContext()),
        renderer(*context),
        scene(*set, levels.get(), renderer) {}

  // Draws one frame and waits for its last pixel; ms.
  double frame(const SceneFrame& wanted) {
    const auto start = std::chrono::steady_clock::now();
    const double cpu_start_ms = cpu_ms();
    figures = scene.draw(wanted);
    renderer.finish();
    frame_cpu_ms = cpu_ms() - cpu_start_ms;
    return since_ms(start);
  }
  void settle(const SceneFrame& wanted) {
    do {
      frame(wanted);
      if (figures.pending > 0) scene.waitForTiles(0.1);
    } while (figures.pending > 0 || figures.drawing);
  }

  std::unique_ptr<TileSet> set;
  std::unique_ptr<Levels> levels;
  std::unique_ptr<GraphicsContext> context;
  Renderer renderer;
  SceneView scene;
  SceneFigures figures;
  double frame_cpu_ms = 0;  // of the last frame
};

// The set of the options, else a synthetic one in a folder that the destructor removes.
class BenchScene {
 public:
  explicit BenchScene(const BenchOptions& options);
  const std::string& path() const { return path_; }

 private:
  std::optional<WorkFolder> folder_;
  std::string path_;
};

// Moves as in the window, with the window's budgets: from rest, and in real time. Adds the table `motion`.
void measureMotion(const std::string& path, const BenchOptions& options, const SceneFrame& base, BenchReport& report);
BenchReport runMotion(const BenchOptions& options);

}  // namespace filiform::tools
