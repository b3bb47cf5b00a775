// A scene, drawn frame by frame while its tiles come.
//
//   SceneView scene(*set, levels.get(), renderer);
//   for (;;) {
//     const SceneFigures figures = scene.draw({.camera = camera, .workspace = &workspace, .time_s = now_s});
//     renderer.present(window);
//   }
//
// A frame never waits for the disk. A thread of the SceneView's own loads tiles, those first that mend the largest
// error on the screen; a frame uploads what has come, up to a stated number of bytes and milliseconds, and draws the
// finest that there is for each place: coarser tiles, or finer ones from before, stand in for what has not come. While
// the camera moves a small budget of segments is chosen, at rest the full one. A picture in which nothing changed is
// not drawn again. Thread rule: the thread of the renderer's context.
#pragma once

#include "viewer/gl/renderer.h"
#include "viewer/scene/draw_list.h"
#include "viewer/scene/glyph.h"
#include "viewer/scene/stereo.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct SceneBudget {
  std::uint64_t segments = 2'000'000;         // at rest
  std::uint64_t moving_segments = 2'000'000;  // while the camera moves
  int samples = 2, moving_samples = 2;        // across a pixel
  bool moving_shade = true;                   // eye-dome lighting of far views also while the camera moves
  double enough_px = 0.5;                     // no finer tiles where the error is below
  std::uint64_t upload_bytes = 4U << 20;      // a frame; one tile is always uploaded
  double upload_ms = 2;                       // a frame, likewise
  std::uint64_t card_bytes = 1ULL << 30;      // beyond, tiles that are not drawn are dropped

  // What such a renderer draws smoothly.
  static SceneBudget of(const std::string& renderer_description);
};

// What is drawn in one frame. What it points to must live during the call only.
struct SceneFrame {
  Camera camera{};
  // Drawn as boxes; fog begins behind its middle, and threads before it thin out. None: fog and eye-dome lighting over
  // the whole scene.
  const Workspace* workspace = nullptr;
  std::optional<Vector3d> proxy_W{};   // drawn as a ball
  const Junction* junction = nullptr;  // drawn as glyph
  GlyphPalette palette = kRedGreen;    // kForGlasses takes its place where the picture is for such
  ColourBy colour = ColourBy::cell;
  std::optional<std::uint32_t> cell{};  // drawn in full resolution over the others, which recede
  bool orthographic = false;            // see parallel()
  // Of any clock that does not run back: tells rest from motion, smooths the eyes' separation, tries failed tiles
  // again.
  double time_s = 0;
  std::optional<bool> moving{};  // none: moving until kRest_s after the camera's or the proxy's last change

  PictureSize size{};
  StereoMode stereo = StereoMode::mono;
  StereoOptions eyes{};
  SceneBudget budget{};
  bool frozen = false;    // tiles stay as they are, however the camera moves
  double mark_scale = 0;  // of lines and balls that mark; 0: by the picture's height

  static constexpr double kRest_s = 0.3;
};

struct SceneFigures {
  RenderFigures drawn;
  bool redrawn = false;              // else nothing had changed, and the last picture stands
  bool moving = false;               // drawn within the smaller budget
  bool complete = false;             // all that was chosen is drawn; nothing stands in
  std::uint64_t segments = 0;        // of the tiles that are drawn
  std::uint64_t left_out = 0;        // full-resolution segments in the picture that nothing drawn stands for
  std::uint64_t tiles_left_out = 0;  // without levels: beyond the budget
  double error_px = 0;               // of what is drawn, at most
  double wanted_error_px = 0;        // of what was chosen
  std::uint32_t tiles = 0;           // drawn
  std::uint32_t stand_ins = 0;       // of these, coarser or finer than chosen
  bool has_gaps = false;             // for some place there is nothing to draw yet
  std::uint32_t pending = 0;         // tiles wanted and not there yet
  std::uint32_t uploads = 0;         // in this frame
  std::uint64_t upload_bytes = 0;
  double upload_ms = 0;
  std::uint64_t card_bytes = 0;         // of all batches
  std::uint64_t implausible_radii = 0;  // in the drawn tiles
  double separation = 0;                // of the eyes, over the distance at which they converge
  std::vector<std::string> failed;      // one line for each tile that cannot be read, with the reason
};

class SceneView {
 public:
  // Store, levels (none: nullptr) and renderer must outlive it. Throws InputError for a scene without a segment. May
  // run on any thread: draws nothing.
  // O(tiles).
  SceneView(const TileStore& store, const Levels* levels, Renderer& renderer);
  // Takes its batches off the renderer.
  ~SceneView();
  SceneView(const SceneView&) = delete;
  SceneView& operator=(const SceneView&) = delete;

  // Of all segments, with room for their thickness; um.
  const Vector3d& lo_W() const noexcept;
  const Vector3d& hi_W() const noexcept;

  // Never waits for a tile. Throws what Renderer::draw throws; a tile that cannot be read is a line of the figures, and
  // is tried again after some seconds. O(tiles in the picture; without levels all tiles) beside the drawing.
  SceneFigures draw(const SceneFrame& frame);
  // The same, at rest, with everything that the full budget asks for: waits for it. `progress` gets tiles done and all,
  // and may throw to stop. Throws the reason of a tile that cannot be read.
  SceneFigures drawWhole(const SceneFrame& frame,
                         const std::function<void(std::size_t done, std::size_t all)>& progress = {});

  // drawWhole() in parts, for a window that must not wait. Each call takes the same frame; it loads and draws for about
  // `most_ms` and returns which part is done: 1 at the end, when the renderer has the picture. Throws as drawWhole().
  double advanceWhole(const SceneFrame& frame, double most_ms);

  // Takes the batches off the renderer and ends the loading thread's work. The result waits for the tile that is being
  // read when it is destroyed, which store and levels must outlive; any thread. Afterwards only the destructor may be
  // called.
  std::shared_ptr<void> end();

  // Waits for the loading thread, at most so long. True when tiles wait to be uploaded.
  bool waitForTiles(double most_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
