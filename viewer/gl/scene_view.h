// A scene that is drawn frame by frame while its tiles are loaded.
//
//   SceneView scene(*set, levels.get(), renderer);
//   for (;;) {
//     const SceneFigures figures = scene.draw({.camera = camera, .workspace = &workspace, .time_s = now_s});
//     renderer.present(window);
//   }
//
// A frame never waits for the disk. A loading thread reads tiles, the one with the largest error on the screen first.
// A frame uploads loaded tiles up to a number of bytes and milliseconds. It then draws the finest uploaded tile of each
// place: until the chosen tile is there, a coarser or finer tile *stands in*. While the camera moves, fewer segments
// are chosen than at rest. A frame draws a picture only if the picture differs from the last one: the view changed, or
// the tiles that are shown. While tiles of an unchanged view are loaded, it draws at most one picture a second, and the
// complete one at once.
// Thread rule: the thread of the renderer's context.
#pragma once

#include "viewer/gl/renderer.h"
#include "viewer/gl/scene_frame.h"
#include "viewer/scene/cell_colours.h"
#include "viewer/scene/draw_list.h"
#include "viewer/scene/glyph.h"
#include "viewer/scene/overlay.h"
#include "viewer/scene/stereo.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

class SceneView {
 public:
  // Store, levels (may be nullptr) and renderer must outlive it. Throws InputError for a scene without a segment. May
  // run on any thread: does not draw. O(groups of the directory); O(tiles) for a
  // set that does not state its usual box, and without levels.
  SceneView(const TileStore& store, const Levels* levels, Renderer& renderer);
  // Removes its batches from the renderer.
  ~SceneView();
  SceneView(const SceneView&) = delete;
  SceneView& operator=(const SceneView&) = delete;

  // The box of all segments, with room for their thickness; um.
  const Vector3d& lo_W() const noexcept;
  const Vector3d& hi_W() const noexcept;
  // The same without the few segments far from all others, and the number of these; see TileStore::usualBox(). Fog and
  // eye-dome lighting of overviews follow it.
  const Vector3d& usual_lo_W() const noexcept;
  const Vector3d& usual_hi_W() const noexcept;
  std::uint64_t far_segments() const noexcept;

  // Draws one frame. Never waits for a tile. Throws what Renderer::draw() throws. A tile that cannot be read adds a
  // line to `SceneFigures::failed`, and is tried again after 5 s. O(tiles in view; without levels all tiles), plus
  // drawing.
  SceneFigures draw(const SceneFrame& frame);
  // Draws the frame as at rest, and waits for all its tiles. Calls `progress` with the numbers of loaded and of all
  // tiles; it may throw to stop. Throws the reason of a tile that cannot be read.
  SceneFigures drawWhole(const SceneFrame& frame,
                         const std::function<void(std::size_t done, std::size_t all)>& progress = {});

  // Does drawWhole() in parts, for a window that must not wait. Call it again with the same frame until it returns 1.
  // Each call loads and draws for about `most_ms`, and returns the part that is done, 0 to 1. At 1 the renderer has the
  // picture. Throws as drawWhole().
  double advanceWhole(const SceneFrame& frame, double most_ms);

  // Removes its batches from the renderer and stops the loading thread. The returned object waits in its destructor for
  // the tile that is being read. Destroy it on any thread, before store and levels. After end() only the destructor may
  // be called.
  std::shared_ptr<void> end();

  // Waits for the loading thread, at most `most_s`. True: tiles wait to be uploaded.
  bool waitForTiles(double most_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
